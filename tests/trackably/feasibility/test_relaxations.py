"""What is asked of a reference, and how far bounds give way: no step, no link and no box is more than what is true."""

from tests.trackably.feasibility.test_impossible import told

STEP = 0.05


def test_times_are_linked_where_windows_of_values_meet():
    """Values hold up to 1e-6 of a step beside their times, and no further."""
    for steps in (1, 3, 10):
        for beside, are_linked in ((-0.9e-6, True), (0.9e-6, True), (-1.1e-6, False), (1.1e-6, False), (1e-3, False)):
            found = told({0.0: {"position": 0.0}, STEP * (steps + beside): {"position": 0.9}})
            assert (found is not None) == are_linked


def test_what_lies_before_the_claim_is_not_examined():
    """It comes from outside of its bounds, and brakes in time."""
    inwards = {0.0: {"position": -0.9, "velocity": 0.5}}
    assert told(inwards) is None
    assert told(inwards, claim=(0.0, 9.0)) is None
    assert told(inwards, claim="all_phases").given == "velocity = 0.5 at t = 0 s"
    assert told({3.0: inwards[0.0]}).given == "velocity = 0.5 at t = 3 s"
