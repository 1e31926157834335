"""Computing times of the project beside those of other tools: `make bench`, or `python -m benchmarks NAME …`."""
