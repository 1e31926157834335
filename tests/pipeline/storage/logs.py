"""A log with everything that a log may hold, and files that are no logs of this project."""

from io import BytesIO

import numpy as np
from mcap.writer import CompressionType, Writer

from pipeline.storage.logs import Log, Series

NAN = float("nan")
TIMES = np.array([0.0, 0.1 + 0.2, 0.3 + 1e-16, 7.0, 1e5 / 3])
LOG = Log(
    series=(
        Series(
            "/reference/sound",
            TIMES,
            {"value": np.array([0.1, NAN, -0.0, 5e-324, 1.7e308]), "left.rate": np.array([NAN] * 4 + [1.0])},
        ),
        Series("/other", TIMES[:3] / 2, {"never": np.full(3, NAN)}),
        Series("/without_rows", np.array([]), {"value": np.array([])}),
        Series("/without_fields", np.array([1.0]), {}),
    ),
    metadata={"experiment": {"name": "ein Beispiel, schön", "seed": "1"}, "empty": {}},
    attachments={"b.json": b'{"x": 0.1}\n', "a.json": b"[]"},
)


SCHEMA = b'{"type": "object", "properties": {"t": {"type": "number"}, "x": {"type": "number"}}}'


def foreign(
    *,
    library: str = "trackably",
    version: str = "1",
    encoding: str = "json",
    schema: bytes = SCHEMA,
    message: bytes = b'{"t":0.0}',
) -> bytes:
    """A sound MCAP file with right checksums, and one message that another program may have written."""
    buffer = BytesIO()
    writer = Writer(buffer, compression=CompressionType.ZSTD, enable_data_crcs=True)
    writer.start(library=library)
    writer.add_metadata("trackably", {"format": version})
    writer.add_attachment(0, 0, "a", "application/json", b"0")
    schema_id = writer.register_schema("x", "jsonschema", schema) if schema else 0
    writer.add_message(writer.register_channel("/x", encoding, schema_id), 0, message, 0)
    writer.finish()
    return buffer.getvalue()
