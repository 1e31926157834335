"""The library's frozen dataclasses as JSON: one form each, for logs, saved references and certificates."""

from trackable.codec.converter import decode, dumps, encode, loads
from trackable.codec.values import CodecError

__all__ = ["CodecError", "decode", "dumps", "encode", "loads"]
