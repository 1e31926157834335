"""A viewer of logs in the browser: fetched with npm, served on this machine only."""
