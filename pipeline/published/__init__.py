"""The paper: its algorithms for scalar systems, its printed numbers and curves, and the signals behind its samples."""
