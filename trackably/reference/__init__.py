"""From samples to a reference with a proof: input, prior, search, judge, and what a user holds in the end."""
