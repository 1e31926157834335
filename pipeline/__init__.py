"""The staged experiment pipeline: `python -m pipeline STAGE EXPERIMENT`, driven by `dvc repro`."""

import sys

from pipeline.environment import pin

pin()  # before anything loads NumPy
# What reads notebooks loads jsonschema, which would compile a grammar of IRIs for seconds, though nothing here has any.
sys.modules.setdefault("rfc3987_syntax", None)  # type: ignore[arg-type]
