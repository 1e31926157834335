"""Files that stages write and read: MCAP logs, JSON, CSV and YAML."""
