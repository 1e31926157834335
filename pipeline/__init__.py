"""Trackable: learn a reference from noisy samples, and guarantee that the controlled system can follow it."""

from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
"""The project's folder: parameters, data and results are named relative to it."""
