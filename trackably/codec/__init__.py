"""The library's frozen dataclasses as JSON: one form each, for logs, saved references and certificates."""

from trackably.codec.converter import decode, dumps, encode, loads
from trackably.codec.values import CodecError

__all__ = ["CodecError", "decode", "dumps", "encode", "loads"]
