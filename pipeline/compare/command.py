"""The command line of the comparison: `main.add_command(compare)`."""

from contextlib import ExitStack
from pathlib import Path

import click

FILE = click.Path(dir_okay=False, path_type=Path)


@click.command("compare", short_help="Compare two sets of results, and check the claims.")
@click.argument("base")
@click.argument("new", default=".")
@click.option(
    "--tolerances", type=FILE, default=Path("tolerances.yaml"), show_default=True, help="How far values may move."
)
@click.option("--claims", type=FILE, default=Path("claims.yaml"), show_default=True, help="What the paper claims.")
@click.option("--markdown", "markdown_file", type=FILE, help="Also write a report for a pull request.")
@click.option("--all", "list_all", is_flag=True, help="List identical artifacts too.")
@click.pass_context
def compare(
    context: click.Context,
    base: str,
    new: str,
    tolerances: Path,
    claims: Path,
    markdown_file: Path | None,
    list_all: bool,
) -> None:
    """Say what moved from BASE to NEW, by how much and where, and which of the paper's claims hold in each.

    BASE and NEW are git revisions or folders, each of a project or of its results alone. If NEW is left out, it is this
    project. Exit codes: 0 all artifacts are within tolerance and all claims hold in NEW; 1 otherwise; 2 something is
    not usable.
    """
    # Imported late, like the stages: `--help` should wait for nothing.
    from pipeline.compare.claims import load_claims  # noqa: PLC0415
    from pipeline.compare.comparison import compare as compare_folders  # noqa: PLC0415
    from pipeline.compare.comparison import laid_out  # noqa: PLC0415
    from pipeline.compare.model import load_tolerances  # noqa: PLC0415
    from pipeline.compare.reports import (  # noqa: PLC0415
        everything,
        remarkable,
        to_markdown,
        to_text,
    )
    from trackably.files import write_text  # noqa: PLC0415

    rules, claimed = load_tolerances(tolerances), load_claims(claims)
    with ExitStack() as stack:
        folders = [stack.enter_context(laid_out(name)) for name in (base, new)]
        comparison = compare_folders(folders[0], folders[1], rules, claimed, base, new)
    if markdown_file:
        write_text(markdown_file, to_markdown(comparison))
    click.echo(to_text(comparison, everything if list_all else remarkable), nl=False)
    context.exit(0 if comparison.within else 1)
