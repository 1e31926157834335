"""Boxes of time, many at once: their discs, their centres within reach, enclosures of signals, and where to split."""
