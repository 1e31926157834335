"""MCAP logs, JSON and CSV: what the stages write and read."""
