"""The paper about the software: text from `paper/paper.md.j2`, and every number in it from results."""

from pathlib import Path
from typing import Any

import click
from jinja2 import Environment, FileSystemLoader, StrictUndefined

from pipeline.compare.claims import judge_claim, load_claims
from pipeline.experiments import load_experiments
from pipeline.storage.results import Results
from trackably.files import read_json, write_text


def text_of(project: Path) -> str:
    """Return the paper in Markdown. Raises InputError where results are missing."""
    names = list(load_experiments(project / "params.yaml"))
    results = {name: Results(name, project / "data" / "results") for name in names}
    summaries: dict[str, Any] = {name: read_json(found.summary) for name, found in results.items()}
    claims = [judge_claim(claim, project, project) for claim in load_claims(project / "claims.yaml").claims]
    study: Any = read_json(project / "benchmarks" / "rivals" / "study.json")
    drawn = [row for row in study[-1] if row["factor"] == "all"]
    templates = Environment(
        loader=FileSystemLoader(project / "paper"),
        undefined=StrictUndefined,
        keep_trailing_newline=True,
    )
    return templates.get_template("paper.md.j2").render(
        summaries=summaries,
        claims=len(claims),
        held=sum(claim.new.holds for claim in claims),
        certificates=sum(1 for found in results.values() for _ in found.certificate("any").parent.glob("*.json")),
        drawn=drawn,
        rivals=len({row["rival"] for row in drawn}),
    )


@click.command("paper", short_help="Write paper/paper.md: its text, with the numbers of the results.")
@click.option("--project", type=click.Path(file_okay=False, path_type=Path), default=Path())
def paper(project: Path) -> None:
    """Write paper/paper.md from paper/paper.md.j2 and the results."""
    write_text(path := project / "paper" / "paper.md", text_of(project))
    click.echo(path)
