"""The command line: `main.add_command(reproduce)`."""

from pathlib import Path

import click


@click.command("reproduce", short_help="Run every stage from nothing, and compare.")
@click.option(
    "--into",
    type=click.Path(file_okay=False, path_type=Path),
    default=Path(".reproduced"),
    show_default=True,
    help="Folder for the copy; what is in it is deleted.",
)
@click.option("--jobs", type=click.IntRange(1), default=2, show_default=True, help="Stages that run at a time.")
@click.pass_context
def reproduce(context: click.Context, into: Path, jobs: int) -> None:
    """Run every stage of every experiment in a copy of the project that holds no results, and compare.

    Ends with the paper's claims, what they expect beside our values, and with how many artifacts are identical to those
    in data/results, or within tolerance of them. The project itself stays as it is. Exit codes are those of `compare`.
    """
    # Imported late, like the stages: `--help` should wait for nothing.
    from pipeline.compare.claims import load_claims  # noqa: PLC0415
    from pipeline.compare.comparison import compare  # noqa: PLC0415
    from pipeline.compare.reports.text import to_text  # noqa: PLC0415
    from pipeline.compare.reports.wording import beyond  # noqa: PLC0415
    from pipeline.compare.tolerances import load_tolerances  # noqa: PLC0415
    from pipeline.reproduce.copy import copy_without_results  # noqa: PLC0415
    from pipeline.reproduce.run import run  # noqa: PLC0415
    from pipeline.reproduce.stages import plan_of  # noqa: PLC0415

    here = Path()
    plan, tolerances, claims = plan_of(here), load_tolerances(), load_claims()
    copy_without_results(here, into)
    run(plan, into, jobs, lambda line: click.echo(line, err=True))
    comparison = compare(here, into, tolerances, claims, "data/results", "reproduced")
    click.echo(to_text(comparison, beyond), nl=False)
    context.exit(0 if comparison.within else 1)
