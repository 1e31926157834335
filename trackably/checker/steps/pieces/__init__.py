"""References of polynomial pieces: everything about them is checked in whole and rational numbers."""
