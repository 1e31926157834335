"""One hypothesis profile for the whole suite, the same examples on every machine; one BLAS thread, as in stages."""

from hypothesis import settings
from threadpoolctl import threadpool_limits

settings.register_profile("reproducible", derandomize=True, deadline=None, max_examples=25, database=None)
settings.load_profile("reproducible")

threadpool_limits(limits=1)
