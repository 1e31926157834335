"""A naive reader of a JointTrajectory in CDR (little endian), from the rules of the format: bytes in, numbers out."""

import struct
from typing import Any


class Cursor:
    """Reads values one by one; each begins at a multiple of its size, counted from the end of the 4 bytes in front."""

    def __init__(self, data: bytes) -> None:
        assert data[:4] == b"\x00\x01\x00\x00"
        self.data, self.place = data[4:], 0

    def one(self, code: str) -> Any:
        size = struct.calcsize(code)
        self.place += -self.place % size
        (value,) = struct.unpack_from(f"<{code}", self.data, self.place)
        self.place += size
        return value

    def text(self) -> str:
        length = self.one("I")
        value = self.data[self.place : self.place + length]
        self.place += length
        assert value[-1:] == b"\0"
        return value[:-1].decode()

    def floats(self) -> list[float]:
        return [self.one("d") for _ in range(self.one("I"))]


def joint_trajectory(data: bytes) -> dict[str, Any]:
    cursor = Cursor(data)
    stamp = cursor.one("i"), cursor.one("I")
    found: dict[str, Any] = {"stamp": stamp, "frame": cursor.text()}
    found["joints"] = [cursor.text() for _ in range(cursor.one("I"))]
    found["points"] = [
        {
            **{name: cursor.floats() for name in ("positions", "velocities", "accelerations", "effort")},
            "since": (cursor.one("i"), cursor.one("I")),
        }
        for _ in range(cursor.one("I"))
    ]
    assert cursor.place == len(cursor.data)
    return found
