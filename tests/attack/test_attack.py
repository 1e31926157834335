"""The attack runs, tells the same numbers again, and sees what is false."""

from tests.attack.__main__ import main
from tests.attack.counts import Counts, table
from tests.trackably.checker.instances import scalar_certificate


def test_a_short_attack_finds_nothing_false(capsys, monkeypatch) -> None:
    from trackably.certificates import cover, draft, prove  # noqa: PLC0415

    for module in (cover, draft, prove):
        monkeypatch.setattr(module, "TERMS", module.TERMS)  # it is set to a smaller number, for this test only
    assert main(["--tamperings", "12", "--references", "5", "--seed", "17"]) == 0
    said = capsys.readouterr()
    assert said.err == ""
    rows = [line for line in said.out.splitlines() if line.count("|") == 8][2:]
    assert len(rows) >= 10
    assert all(row.split("|")[5].strip() == "0" for row in rows)


def test_what_is_accepted_and_not_true_is_told() -> None:
    counts = Counts()
    counts.attacked("a change", scalar_certificate(), lambda: False)
    counts.attacked("another one", scalar_certificate(), lambda: True)
    counts.attacked("no certificate", {}, lambda: False)
    assert (counts.tried, counts.accepted, counts.true, counts.false) == (3, 2, 1, ["a change"])
    assert "| family | tried |" in table({"bounds": counts})
