"""What a user can mend, and what is nobody's fault."""


class InputError(Exception):
    """Something handed in is not usable; the message says what was expected, what came, and where. Exit code 2."""


class NoReferenceError(Exception):
    """A well-posed question whose answer is that no trackable reference was found; says by how much. Exit code 1."""
