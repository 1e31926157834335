"""Flat outputs of a system: signals that determine its states and inputs."""
