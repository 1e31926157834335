"""The staged experiment pipeline: `python -m pipeline STAGE EXPERIMENT`, driven by `dvc repro`."""
