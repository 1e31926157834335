"""Facts about what rivals hand out: by how much a bound is broken at any time, with certainty."""
