"""Options that several commands have: where parameters, results and the project are."""

from pathlib import Path

import click

from pipeline.experiments import PARAMS

FOLDER = click.Path(file_okay=False, path_type=Path)
PATH = click.Path(path_type=Path)

params = click.option("--params", type=PATH, default=PARAMS, show_default=True, help="Parameter file.")
results = click.option("--results", type=PATH, default=Path("data/results"), show_default=True)
project = click.option("--project", type=FOLDER, default=Path(), help="Where params.yaml and the results are.")
