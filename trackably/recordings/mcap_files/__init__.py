"""Recordings from MCAP files."""
