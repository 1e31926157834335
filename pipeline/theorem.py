"""A record of which certificates Coq has proved, which is read without Coq, and the command that writes it."""

import re
import subprocess
from collections.abc import Mapping
from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path
from tempfile import TemporaryDirectory

import click

from pipeline import options
from pipeline.experiments import load_experiment, load_experiments
from pipeline.storage.results import Results
from pipeline.yaml_file import Fields, validated
from trackably.errors import InputError
from trackably.files import read_bytes, read_json, write_json
from trackably.theorem import Theorem
from trackably.theorem import theorem as stated_in

THEORY = Path("theorem")
"""The folder of the theory in Coq, and of the record `proved.json`."""


class Proved(Fields):
    """A statement that Coq has proved, by the SHA-256 of its text.

    `meaning` is the SHA-256 of Statement.v, which defines the words of statements, and `axioms` that of the sorted
    names of all axioms on which the proof rests. `theorems` are the claims in words, by the name of the theorem.
    `printed` is the text that Coq prints of the theorems: empty if it is too long to be read.
    """

    coq: str
    statement: str
    meaning: str
    axioms: str
    theorems: dict[str, str]
    printed: str = ""


class Record(Fields):
    """All proved statements, by experiment and by the name of the certificate's file."""

    experiments: dict[str, dict[str, Proved]]


def meaning(theory: Path = THEORY) -> str:
    """Return the SHA-256 of Statement.v, which defines the words of statements."""
    return sha256(read_bytes(theory / "Statement.v")).hexdigest()


def proved_by_coq(results: Results, theory: Path = THEORY) -> dict[str, Proved]:
    """Return, by the certificate's file, the recorded proofs of the statements that the files make today.

    A recorded proof of another statement, or with other definitions of its words, is left out.
    """
    recorded = read_record(theory).get(results.experiment, {})
    words = meaning(theory) if recorded else ""
    found = {file.stem: recorded[file.stem] for file in results.proofs if file.stem in recorded}
    return {
        name: proved
        for name, proved in found.items()
        if (proved.meaning, proved.statement) == (words, _statement(results.certificate(name)))
    }


def read_record(theory: Path = THEORY) -> Mapping[str, Mapping[str, Proved]]:
    """Return the recorded proofs, by experiment and file; empty without a record. InputError: it cannot be read."""
    path = theory / "proved.json"
    return validated(Record, read_json(path), path).experiments if path.exists() else {}


def write_record(experiments: Mapping[str, Mapping[str, Proved]], theory: Path = THEORY) -> None:
    """Write the record, with experiments and files in the order of their names."""
    ordered = {experiment: dict(sorted(of.items())) for experiment, of in sorted(experiments.items()) if of}
    write_json(theory / "proved.json", Record(experiments=ordered).model_dump())


def _statement(file: Path) -> str | None:
    """Return the SHA-256 of the statement of a certificate; None if the theory in Coq does not cover it."""
    try:
        return stated_in(file).fingerprint
    except InputError:
        return None


_LONGEST = 8000  # longest text of Coq, in characters, that is recorded: nobody reads more
_QUERY = """From Coq Require Import QArith List Reals.
From Trackably Require Import Statement.
From Given Require Import stated.
Import ListNotations.
Set Printing Width 110.
Open Scope Q_scope.
{}
Open Scope R_scope.
Print {}.
{}
"""
_DEFINED = re.compile(r"^Definition (\w+)", re.MULTILINE)
_AXIOM = re.compile(r"^[A-Z][\w.]+", re.MULTILINE)


@dataclass(frozen=True)
class Run:
    """The result of running Coq on a file, and all that Coq printed."""

    accepted: bool
    printed: str
    complaint: str


@click.command("theorem", short_help="Let Coq prove what certificates state, and record it.")
@click.argument("experiments", nargs=-1)
@options.params
@options.results
@click.pass_context
def theorem(context: click.Context, experiments: tuple[str, ...], params: Path, results: Path) -> None:
    """Prove the certificates and counterexamples of EXPERIMENTS with Coq; without names, those of all experiments.

    `make theorem NAME=…` compiles the theory first. Proofs are recorded in theorem/proved.json. Exit codes: 0 all files
    that the theory covers are proved; 1 Coq refuses a file.
    """
    known = read_record() if experiments else {}
    proved: dict[str, dict[str, Proved]] = {}
    refused = False
    for name in experiments or load_experiments(params):
        proved[load_experiment(name, params).name] = {}
        for file in Results(name, results).proofs:
            try:
                stated = stated_in(file)
            except InputError as error:
                click.echo(f"not covered: {error}")
                continue
            run = run_coq(stated)
            if run.accepted:
                proved[name][file.stem] = proved_in(stated, run)
                said = ", ".join(f"{part.name} : {part.says}" for part in stated.parts)
                click.echo(f"{file}: {said}, proved by Coq; statement SHA-256 {stated.fingerprint}")
            else:
                refused = True
                click.echo(f"{file}: REFUSED by Coq: {run.complaint}", err=True)
    write_record({**known, **proved})
    context.exit(1 if refused else 0)


def run_coq(stated: Theorem, theory: Path = THEORY) -> Run:
    """Let Coq prove a file, then print its theorems and the axioms on which they rest.

    Raises InputError if Coq is not installed.
    """
    with TemporaryDirectory() as folder:
        file = Path(folder) / "stated.v"
        file.write_text(stated.text, encoding="utf-8")
        run = _coqc(file, theory)
        if not run.accepted:
            return run
        query = file.with_name("query.v")
        query.write_text(_query(stated), encoding="utf-8")
        return replace(run, printed=_coqc(query, theory).printed)


def _query(stated: Theorem) -> str:
    names = [name for part in stated.parts for name in _DEFINED.findall(part.definition)]
    shown = "\n".join((*(f"Print {name}." for name in names), *(f"Check {part.name}." for part in stated.parts)))
    words = stated.parts[-1].says.removeprefix("~ ").split()[0]
    return _QUERY.format(shown, words, "\n".join(f"Print Assumptions {part.name}." for part in stated.parts))


def _coqc(file: Path, theory: Path) -> Run:
    command = ["coqc", "-q", "-Q", str(theory), "Trackably", "-Q", str(file.parent), "Given", str(file)]
    try:
        ended = subprocess.run(command, capture_output=True, text=True, check=False)
    except FileNotFoundError as error:
        raise InputError("Coq with CoqInterval is not installed: apt-get install coq libcoq-interval") from error
    complaint = " ".join(ended.stderr.split())
    return Run(ended.returncode == 0, ended.stdout, complaint)


def proved_in(stated: Theorem, run: Run, theory: Path = THEORY) -> Proved:
    """Return the record of a proof. InputError: it rests on axioms that theorem/assumptions.txt does not name."""
    printed, *resting = run.printed.split("Axioms:\n")
    axioms = sorted({name for one in resting for name in _AXIOM.findall(one)})
    trusted, _ = ({*_AXIOM.findall(one)} for one in (theory / "assumptions.txt").read_text().split("Axioms:")[1:])
    if len(resting) != len(stated.parts) or not trusted.issuperset(axioms):
        raise InputError(f"a proof rests on axioms that theorem/assumptions.txt does not name: {', '.join(axioms)}")
    return Proved(
        coq=version(),
        statement=stated.fingerprint,
        meaning=meaning(theory),
        axioms=sha256("\n".join(axioms).encode()).hexdigest(),
        theorems={part.name: part.says for part in stated.parts},
        printed=printed.strip() if len(printed) <= _LONGEST else "",
    )


def version() -> str:
    """Return Coq's version."""
    return subprocess.run(["coqc", "--print-version"], capture_output=True, text=True, check=True).stdout.split()[0]
