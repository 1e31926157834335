"""One hypothesis profile for the whole suite: the same examples on every machine, however slow."""

from hypothesis import settings

settings.register_profile("reproducible", derandomize=True, deadline=None, max_examples=25, database=None)
settings.load_profile("reproducible")
