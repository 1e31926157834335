"""Run a stage, or compare results: the command line."""

import signal

if __name__ == "__main__" and signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:  # ignored by background jobs
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # Ctrl-C ends the imports below without a traceback

import sys
from collections.abc import Callable
from contextlib import ExitStack
from importlib import import_module
from pathlib import Path

import click

from pipeline import options
from pipeline.experiments import Experiment, load_experiment, parameters_of
from pipeline.reproduce import reproduce
from pipeline.storage.results import Results
from pipeline.theorem import theorem
from trackably.codec import CodecError
from trackably.errors import InputError, NoReferenceError
from trackably.files import unwritable, write_text

_FILE = click.Path(dir_okay=False, path_type=Path)
_NOTHING_FOUND, _UNUSABLE, _INTERRUPTED = 1, 2, 130


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
def main() -> None:
    """Learn references from noisy samples that a constrained system can follow.

    Stages run for one EXPERIMENT of params.yaml and write below data/results/EXPERIMENT. Exit codes: 0 done; 1 no
    trackable reference was found; 2 an argument or a file is not usable; 130 interrupted. Earlier results are replaced
    only with exit code 0.
    """


def _stage(name: str, summary: str) -> None:
    @main.command(name, help=summary, short_help=summary)
    @click.argument("experiment")
    @options.params
    @options.results
    def command(experiment: str, params: Path, results: Path) -> None:
        # Imported late: `--help` and a wrong parameter should not wait for SciPy and matplotlib.
        stage: Callable[[Experiment, Results], None] = getattr(import_module(f"pipeline.{name}"), name)
        stage(load_experiment(experiment, params), Results(experiment, results, parameters_of(experiment, params)))


_stage("generate", "Stage 1: read or draw the noisy samples.")
_stage("fit", "Stage 2: learn the references.")
_stage("verify", "Stage 3: compute margins and metrics, and prove what methods claim.")
_stage("control", "Stage 4: close the loop on the references.")
_stage("figures", "Stage 5: draw the figures.")


@main.command("notebook", short_help="Stage 6: execute a notebook in place.")
@click.argument("name")
@options.params
def _notebook(name: str, params: Path) -> None:
    """Execute notebooks/NAME.ipynb in place.

    If there is no such notebook, a copy of the template is made for the experiment NAME.
    """
    from pipeline.notebook import notebook, path_of  # noqa: PLC0415  as for the stages

    notebook(name if path_of(name).exists() else load_experiment(name, params).name)


@main.command("record", short_help="Write the simulated recordings.")
def _record() -> None:
    """Write the simulated recordings in data/recordings, from which further experiments learn."""
    from pipeline.record import record  # noqa: PLC0415  as for the stages

    record()


@main.command("compare", short_help="Compare two sets of results, and check the claims.")
@click.argument("base")
@click.argument("new", default=".")
@click.option(
    "--tolerances", type=_FILE, default=Path("tolerances.yaml"), show_default=True, help="How far values may move."
)
@click.option("--claims", type=_FILE, default=Path("claims.yaml"), show_default=True, help="What the paper claims.")
@click.option("--markdown", "markdown_file", type=_FILE, help="Also write a report for a pull request.")
@click.option("--all", "list_all", is_flag=True, help="List identical artifacts too.")
@click.pass_context
def _compare(
    context: click.Context,
    base: str,
    new: str,
    tolerances: Path,
    claims: Path,
    markdown_file: Path | None,
    list_all: bool,
) -> None:
    """Say which results differ between BASE and NEW, by how much and where, and which of the paper's claims hold.

    BASE and NEW are git revisions or folders, each of a project or of its results alone. If NEW is left out, it is this
    project. Exit codes: 0 all artifacts are within tolerance and all claims hold in NEW; 1 otherwise; 2 an argument or
    a file is not usable.
    """
    # Imported late, like the stages: `--help` should wait for nothing.
    from pipeline.compare.claims import load_claims  # noqa: PLC0415
    from pipeline.compare.comparison import compare, laid_out  # noqa: PLC0415
    from pipeline.compare.model import Status, load_tolerances  # noqa: PLC0415
    from pipeline.compare.reports import to_markdown, to_text  # noqa: PLC0415

    rules, claimed = load_tolerances(tolerances), load_claims(claims)
    with ExitStack() as stack:
        folders = [stack.enter_context(laid_out(name)) for name in (base, new)]
        comparison = compare(folders[0], folders[1], rules, claimed, base, new)
    if markdown_file:
        write_text(markdown_file, to_markdown(comparison))
    click.echo(to_text(comparison, () if list_all else (Status.IDENTICAL,)), nl=False)
    context.exit(0 if comparison.within else 1)


@main.command("report", short_help="Write a static site: the documentation and all results.")
@options.project
@click.option("--output", type=options.FOLDER, default=Path("report/site"), show_default=True)
def _report(project: Path, output: Path) -> None:
    """Write the documentation, and pages about the results: claims, experiments and benchmarks.

    The pages need neither a server nor a network: open index.html.
    """
    from pipeline.site.build import build  # noqa: PLC0415  as for the stages

    for warning in build(project, output):
        click.echo(warning, err=True)
    click.echo(output / "index.html")


@main.command("paper", short_help="Write paper/paper.md: its text, with the numbers of the results.")
@options.project
def _paper(project: Path) -> None:
    """Write paper/paper.md from paper/paper.md.j2 and the results."""
    from pipeline.site.build import text_of  # noqa: PLC0415  as for the stages

    write_text(path := project / "paper" / "paper.md", text_of(project))
    click.echo(path)


main.add_command(reproduce)
main.add_command(theorem)


def run() -> None:
    """Run the command line; report an error that a user can act on in one sentence on stderr and by an exit code."""
    try:
        sys.exit(main(standalone_mode=False))
    except click.ClickException as error:
        error.show()
        sys.exit(error.exit_code)
    except click.Abort:
        sys.exit(_INTERRUPTED)
    except NoReferenceError as error:
        click.echo(f"failed: {error}", err=True)
        sys.exit(_NOTHING_FOUND)
    except (InputError, CodecError) as error:
        click.echo(f"error: {error}", err=True)
        sys.exit(_UNUSABLE)
    except OSError as error:
        click.echo(f"error: {unwritable(error)}", err=True)
        sys.exit(_UNUSABLE)


if __name__ == "__main__":
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    run()
