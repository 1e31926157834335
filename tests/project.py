"""Where the project is: tests read its parameters, data and results."""

from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
