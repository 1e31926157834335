"""What the paper published: samples, curves, printed numbers, and the signals behind drawn samples."""
