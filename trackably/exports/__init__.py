"""Proved references in the forms that other tools use: Python's conventions, files and formats."""
