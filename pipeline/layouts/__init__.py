"""Layouts for viewers of logs, in the form that Lichtblick and Foxglove import."""
