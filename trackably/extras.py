"""Optional packages: the extra of this package that installs each, and the error for one that is missing."""

from collections.abc import Iterator
from contextlib import contextmanager

from trackably.errors import InputError

EXTRA_OF = {
    "matplotlib": "plots",
    "google": "recordings",  # the name under which protobuf is imported
    "lz4": "recordings",
    "mcap": "recordings",
    "mcap_protobuf": "recordings",
    "mcap_ros2": "recordings",
    "pyarrow": "recordings",
    "zstandard": "recordings",
    "joblib": "fleet",
}
"""The extra that installs each optional package, by the name under which it is imported."""


class MissingExtra(InputError, ImportError):
    """A package that only some users need is not installed; the message says how to install it."""


@contextmanager
def optional(what: str) -> Iterator[None]:
    """Import optional packages within this context, for the feature named `what`.

    MissingExtra: one is not installed.
    """
    try:
        yield
    except ModuleNotFoundError as error:
        package = (error.name or "").partition(".")[0]
        if package not in EXTRA_OF:
            raise
        command = f"pip install 'trackably[{EXTRA_OF[package]}]'"
        raise MissingExtra(f"{what}: needs the package {package!r}, which is not installed: {command}") from None
