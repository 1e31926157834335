"""The staged experiment pipeline: `python -m pipeline STAGE EXPERIMENT`, driven by `dvc repro`."""

from pipeline.environment.pin import pin

pin()  # before anything loads NumPy
