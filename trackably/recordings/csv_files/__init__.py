"""Recordings from CSV files."""
