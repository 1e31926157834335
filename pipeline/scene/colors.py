"""Colours of lines in viewers."""

INK, GREY = "#000000", "#888888"
COLORS = ("#ff7f2a", "#2f8fe8", "#2fc46b", "#e06fc0", "#d9b400", "#35c9c9", "#a07be0", "#e05a5a")
"""Bright ones: viewers draw the values darker than the lines between them."""
