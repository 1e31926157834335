"""Normal distributions between bounds."""
