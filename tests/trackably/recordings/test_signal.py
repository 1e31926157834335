"""Signals and recordings: what is selected and thinned is a part of what was there, bit for bit."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from trackably.recordings import Cleaning, Finding, Recording, Signal

UNEVEN = Signal(np.array([-1.0, 0.0, 0.1, 0.25, 3.0]), np.array([5.0, 4.0, 3.0, 2.0, 1.0]), np.full(5, 0.1))
TIMES = st.lists(st.floats(0, 100), min_size=1, max_size=60, unique=True).map(sorted)


def signal(times: list[float]) -> Signal:
    return Signal(np.array(times), np.sin(times), np.array(times) + 1)


def same(a: Signal, b: Signal) -> bool:
    def content(s: Signal) -> object:
        return s.times.tobytes(), s.values.tobytes(), None if s.noise_std is None else s.noise_std.tobytes()

    return content(a) == content(b)


def test_select_takes_both_ends() -> None:
    assert same(UNEVEN.select(0.0, 0.25), Signal(UNEVEN.times[1:4], UNEVEN.values[1:4], np.full(3, 0.1)))
    assert len(UNEVEN.select(0.1, 0.1)) == 1


@given(TIMES, st.floats(0.01, 50))
def test_thinning_as_it_is_described(times: list[float], seconds: float) -> None:
    chosen = [times[0]]
    while later := [t for t in times if t > chosen[-1] and t >= chosen[-1] + seconds - seconds / 2]:
        chosen.append(min(later, key=lambda t: abs(t - (chosen[-1] + seconds))))
    assert signal(times).every(seconds).times.tolist() == chosen


REPORT = Cleaning("a.csv", 7, (Finding("no value of x", 2, "line 3"),))
RECORDING = Recording({"x": UNEVEN, "y": signal([0.0, 2.0, 4.0])}, 17, (REPORT,))


def test_a_recording_does_what_its_signals_do() -> None:
    selected, thin = RECORDING.select(0, 3), RECORDING.every(1.0)
    for name in ("x", "y"):
        assert same(selected[name], RECORDING[name].select(0, 3))
        assert same(thin[name], RECORDING[name].every(1.0))
        assert RECORDING.samples(name).times.tobytes() == RECORDING[name].times.tobytes()
    for part in (selected, thin):
        assert (part.origin, part.cleanings) == (17, (REPORT,))
