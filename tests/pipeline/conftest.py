"""References that the control stage's tests follow: those of the controller's tests."""

from tests.trackably.control.conftest import example, example1, example2

__all__ = ["example", "example1", "example2"]
