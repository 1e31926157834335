"""Count what happens to controllers under disturbances: `python -m pipeline.disturbed STEPS`."""
