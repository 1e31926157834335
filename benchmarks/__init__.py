"""What the project costs, beside what else would do: `make bench`, or `python -m benchmarks NAME …`."""
