"""Excerpts of recordings are thinned as `thin_out` says."""

from hypothesis import given
from hypothesis import strategies as st

from pipeline.generate import thin_out
from trackably.gp.samples import Samples

TIMES = st.lists(st.floats(0, 100), min_size=1, max_size=60, unique=True).map(sorted)


@given(TIMES, st.floats(0.01, 50))
def test_thinning_as_it_is_described(times, seconds):
    chosen = [times[0]]
    while later := [t for t in times if t > chosen[-1] and t >= chosen[-1] + seconds - seconds / 2]:
        chosen.append(min(later, key=lambda t: abs(t - (chosen[-1] + seconds))))
    assert thin_out(Samples(times, times), seconds).times.tolist() == chosen
