"""Show on a terminal how far a check is, if it takes longer than a few seconds."""

import sys
from time import monotonic

_PATIENCE, _EVERY = 3.0, 0.25
"""Seconds before the first line, and between two."""


class ProgressLine:
    """One line of stderr, written over and over; nothing where stderr is no terminal."""

    def __init__(self) -> None:
        self._next = monotonic() + _PATIENCE
        self._width = 0

    def __call__(self, done: int, of: int) -> None:
        """Say how many boxes or instants are checked, unless that was said a moment ago."""
        if monotonic() >= self._next and sys.stderr.isatty():
            self._next = monotonic() + _EVERY
            self._write(f"checked {done} of {of}")

    def clear(self) -> None:
        """Leave an empty line."""
        if self._width:
            self._write("")
            self._write_raw("\r")

    def _write(self, line: str) -> None:
        self._write_raw(f"\r{line.ljust(self._width)}")
        self._width = len(line)

    def _write_raw(self, text: str) -> None:
        sys.stderr.write(text)
        sys.stderr.flush()
