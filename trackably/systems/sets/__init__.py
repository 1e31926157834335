"""Sets: intervals and polytopes."""
