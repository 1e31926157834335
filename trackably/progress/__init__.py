"""Show the progress of long computations: by a line on a terminal, or by a log."""
