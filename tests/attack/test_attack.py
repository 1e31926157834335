"""The attack runs, tells the same numbers again, and sees what is false."""

from tests.attack.__main__ import ATTACKS
from tests.attack.command import run
from tests.attack.counts import Counts, table
from tests.attack.truth import is_kept
from tests.trackably.checker.changes import PLANT, changed, combined_changes
from tests.trackably.checker.instances import scalar_certificate


def test_a_short_attack_finds_nothing_false(capsys, monkeypatch) -> None:
    from trackably.certificates import cover, draft, prove  # noqa: PLC0415

    for module in (cover, draft, prove):
        monkeypatch.setattr(module, "TERMS", module.TERMS)  # it is set to a smaller number, for this test only
    assert run("", ATTACKS, ["--tamperings", "12", "--references", "5", "--seed", "17"]) == 0
    said = capsys.readouterr().out
    assert "false: 0" in said
    assert said.count(" s |\n") >= 10  # rows of families


def test_what_is_accepted_and_not_true_is_told() -> None:
    counts = Counts()
    counts.attacked("a change", scalar_certificate(), lambda: False)
    counts.attacked("another one", scalar_certificate(), lambda: True)
    counts.attacked("no certificate", {}, lambda: False)
    assert (counts.tried, counts.accepted, counts.true, counts.false) == (3, 2, 1, ["a change"])
    assert "| family | tried |" in table({"bounds": counts})


def test_what_is_true_is_said_of_the_stored_trajectories() -> None:
    """The state rests at 0, whatever the signal does, of which the system's own trajectories would move it."""
    still = dict(combined_changes(scalar_certificate()))["all looks times 0"]
    moved = changed(still, ("reference", "signals", 0, "mean"), 5.0)
    assert is_kept(moved)
    assert not is_kept(changed(moved, (*PLANT, "state_set", "lower"), [1e-3]))
