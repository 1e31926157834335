"""A fleet of two recordings, learned once: tests that change its files do so in a copy."""

import pytest

from tests.trackably.fleet.recordings import TWO_MOTIONS, learned
from trackably import Fleet


@pytest.fixture(scope="session")
def two(tmp_path_factory: pytest.TempPathFactory) -> Fleet:
    return learned(TWO_MOTIONS, tmp_path_factory.mktemp("two"))
