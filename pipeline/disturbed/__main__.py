"""Run the loops and print the counts: `python -m pipeline.disturbed [STEPS [RESULTS]]`, a million by default."""

from pathlib import Path

import click

from pipeline.disturbed.counts import Counts, disturbed_runs, experiments, random_systems

_RANDOM = 16


def count_all(steps: int, results: Path) -> list[Counts]:
    """Divide the steps equally among the experiments and some random systems, and print the counts of each."""
    cases, found = [*experiments(results), *random_systems(_RANDOM)], []
    for case in cases:
        found.append(disturbed_runs(case, -(-steps // len(cases))))
        print(found[-1], flush=True)
    print(total(found))
    return found


def total(found: list[Counts]) -> Counts:
    """Return the sums of all counts."""
    every = Counts("all")
    for of in found:
        for name in (
            "steps",
            "runs",
            "broken",
            "without_plan",
            "compared",
            "nominal_failed",
            "nominal_on_robust_failed",
        ):
            setattr(every, name, getattr(every, name) + getattr(of, name))
        every.first_failures += of.first_failures
    return every


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
@click.argument("steps", type=click.IntRange(1), default=1_000_000)
@click.argument("results", type=click.Path(exists=True, file_okay=False, path_type=Path), default=Path("data/results"))
def command(steps: int, results: Path) -> None:
    """Count what becomes of STEPS disturbed steps: of the experiments in RESULTS, and of random systems."""
    count_all(steps, results)


if __name__ == "__main__":
    command()
