"""Nothing false, and nothing undecided that float64 can tell: a few of the random splines."""

from tests.splines.__main__ import main


def test_a_few_random_splines(capsys):
    assert main(["--splines", "28", "--seed", "5"]) == 0
    said = capsys.readouterr()
    assert said.err == ""
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in said.out.splitlines()[2:]]
    assert len(rows) == 7
    assert sum(int(row[2]) for row in rows) > 4, "certificates"
    assert sum(int(row[3]) for row in rows) > 15, "counterexamples"
