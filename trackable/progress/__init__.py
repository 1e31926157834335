"""What is under way, and a line on the terminal that shows it."""
