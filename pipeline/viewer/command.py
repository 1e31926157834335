"""The command line of the viewer: `main.add_command(view)`."""

import webbrowser
from pathlib import Path

import click

from pipeline.experiments import PARAMS, load_experiment
from pipeline.storage.results import Results

DIRECTORY = click.Path(file_okay=False, path_type=Path)


@click.command("view", short_help="Show the logs of an experiment in a viewer in the browser.")
@click.argument("experiment")
@click.option("--params", type=click.Path(path_type=Path), default=PARAMS, show_default=True, help="Parameter file.")
@click.option("--results", type=DIRECTORY, default=Path("data/results"), show_default=True)
@click.option("--port", type=int, default=0, help="Port to listen on; a free one by default.")
@click.option("--browser/--no-browser", default=True, show_default=True, help="Open the page in the browser.")
def view(experiment: str, params: Path, results: Path, port: int, browser: bool) -> None:
    """Show all logs of EXPERIMENT in a viewer, with a layout that is made for them.

    The viewer comes from npm at a locked version, once. It is served on the loopback address until Ctrl-C.
    """
    from pipeline.viewer.view import address_of, fetched, server_of, shown  # noqa: PLC0415  # noqa: PLC0415

    loaded = load_experiment(experiment, params)
    served = shown(loaded, Results(experiment, results), fetched())
    with server_of(served, port) as server:
        click.echo(f"{loaded.name}: {address_of(server)} until Ctrl-C")
        if browser:
            webbrowser.open(address_of(server))
        try:
            server.serve_forever()
        except KeyboardInterrupt:
            click.echo()
