"""Run a stage, or compare results: the command line."""

import signal

if __name__ == "__main__" and signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:  # as it is in the background
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # Ctrl-C ends the imports below without a traceback

import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path

import click

from pipeline.compare.command import compare
from pipeline.experiments import PARAMS, Experiment, load_experiment, parameters_of
from pipeline.reproduce import reproduce
from pipeline.site.command import report
from pipeline.site.paper import paper
from pipeline.storage.logs import LogError
from pipeline.storage.results import Results
from pipeline.theorem import theorem
from pipeline.viewer.command import view
from trackably.codec import CodecError
from trackably.errors import InputError, NoReferenceError
from trackably.files import unwritable

_NOTHING_FOUND, _UNUSABLE, _INTERRUPTED = 1, 2, 130


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
def main() -> None:
    """Learn references from noisy samples that a constrained system can follow.

    Stages run for one EXPERIMENT of params.yaml and write below data/results/EXPERIMENT. Exit codes: 0 done; 1 no
    trackable reference was found; 2 something handed in is not usable; 130 interrupted. But on 0 earlier results stay.
    """


def _stage(name: str, summary: str) -> None:
    @main.command(name, help=summary, short_help=summary)
    @click.argument("experiment")
    @click.option(
        "--params", type=click.Path(path_type=Path), default=PARAMS, show_default=True, help="Parameter file."
    )
    @click.option("--results", type=click.Path(path_type=Path), default=Path("data/results"), show_default=True)
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
@click.option("--params", type=click.Path(path_type=Path), default=PARAMS, show_default=True, help="Parameter file.")
def _notebook(name: str, params: Path) -> None:
    """Execute notebooks/NAME.ipynb in place.

    If there is none, the experiment NAME gets a copy of the template.
    """
    from pipeline.notebook import exists, notebook  # noqa: PLC0415  as for the stages

    notebook(name if exists(name) else load_experiment(name, params).name)


@main.command("record", short_help="Write the simulated recordings.")
def _record() -> None:
    """Write the simulated recordings in data/recordings, from which further experiments learn."""
    from pipeline.record import record  # noqa: PLC0415  as for the stages

    record()


main.add_command(compare)
main.add_command(reproduce)
main.add_command(view)
main.add_command(paper)
main.add_command(report)
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
    except (InputError, LogError, CodecError) as error:
        click.echo(f"error: {error}", err=True)
        sys.exit(_UNUSABLE)
    except OSError as error:
        click.echo(f"error: {unwritable(error)}", err=True)
        sys.exit(_UNUSABLE)


if __name__ == "__main__":
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    run()
