"""Recordings: bounds that they break, and hundreds of them at once."""
