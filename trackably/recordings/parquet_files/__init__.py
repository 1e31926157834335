"""Recordings from Parquet files."""
