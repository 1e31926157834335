"""What is under way, and who is told: a line on a terminal, or a log."""
