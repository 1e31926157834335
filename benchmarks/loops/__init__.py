"""What a loop waits for, and who doubts it."""
