"""The staged experiment pipeline: `python -m pipeline STAGE EXPERIMENT`, driven by `dvc repro`."""

from pipeline.environment import pin

pin()  # before anything loads NumPy
