"""Errors and warnings with an explanation for the user."""


class InputError(Exception):
    """An input is not usable; the message says what was expected, what was given, and where. Exit code 2."""


class DoubtfulInputWarning(UserWarning):
    """An input is accepted, but is probably a mistake; the message says why, and what to give instead."""


class NoReferenceError(Exception):
    """The problem is well posed, but no trackable reference was found. Exit code 1.

    The message says by how much bounds are violated, where and why.
    """
