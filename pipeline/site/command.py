"""The command line of the report: `main.add_command(report)`."""

from pathlib import Path

import click

_FOLDER = click.Path(file_okay=False, path_type=Path)


@click.command("report", short_help="Write a static site: the documentation and all results.")
@click.option("--project", type=_FOLDER, default=Path(), help="Where params.yaml and the results are.")
@click.option("--output", type=_FOLDER, default=Path("report/site"), show_default=True)
def report(project: Path, output: Path) -> None:
    """Write the documentation, and pages about what the stages left: claims, experiments, benchmarks, errata.

    They need neither a server nor a network: open index.html.
    """
    from pipeline.site.build import build  # noqa: PLC0415  as for the stages

    for warning in build(project, output):
        click.echo(warning, err=True)
    click.echo(output / "index.html")
