"""The paper: its algorithms for scalar systems, printed numbers and curves, and the true signals of its samples."""
