"""Write CSV text to a file and read it back."""

from trackably.recordings import Column, CsvLayout, read_csv

X = {"x": Column("x")}
COMMAS = CsvLayout(decimal=",")
EXPECTED = [(0.0, 1.5), (0.1, -2.0), (0.25, 3e-7)]


def read(path, text, unit="s", **options):
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_csv(path, "t", unit, options.pop("signals", X), **options)


def pairs(recording, name="x"):
    return list(zip(recording[name].times.tolist(), recording[name].values.tolist(), strict=True))
