"""Coq proves committed certificates, and refuses each whose statement is false."""

import json
import re
import shutil
import subprocess
from dataclasses import replace
from fractions import Fraction
from functools import cache
from operator import itemgetter
from pathlib import Path

import pytest
from mpmath import mp, mpf

from pipeline.storage.results import Results
from pipeline.theorem import Proved, proved_by_coq, proved_in, read_record, run_coq
from tests.project import ROOT
from tests.trackably.certificates import naive
from trackably.__main__ import main
from trackably.codec import decode
from trackably.errors import InputError
from trackably.systems.reference import Reference
from trackably.theorem import theorem

THEORY = ROOT / "theorem"
RESULTS = ROOT / "data" / "results"


def file_of(name):
    return RESULTS / (name.replace("/", "/certificates/") + ".json")


def certificate(name):
    return json.loads(file_of(name).read_text())


@pytest.fixture(scope="module")
def coq(tmp_path_factory):
    """Compile the theory as `make theorem` does, unless that was done; return what compiles theorems, as one file.

    Each is given as a content, whether arithmetic is emulated, and what follows it, and is in a module of its own. Of
    what is `false`, the last computation must not be accepted.
    """
    if shutil.which("coqc") is None:
        pytest.skip("Coq is not installed")
    found = subprocess.run(["coqc", "-where"], capture_output=True, text=True, check=True).stdout.strip()
    if not (Path(found) / "user-contrib" / "Interval").is_dir():
        pytest.skip("CoqInterval is not installed")
    subprocess.run(["make", "--silent", "theorem/Checker.vo"], cwd=ROOT, capture_output=True, check=True)
    folder = tmp_path_factory.mktemp("theorem")

    def compiled(*given, false=False):
        modules, scope = [], "Open Scope Q_scope.\n"
        for i, (content, emulated, more) in enumerate(given):
            (folder / "given.json").write_text(json.dumps(content))
            head, _, body = theorem(folder / "given.json", emulated).text.partition(scope)
            if false:
                body = "Fail Qed.\nAbort.".join(body.rsplit("Qed.", 1))
            modules.append(f"Module M{i}.\n{body}{more}End M{i}.\n")
        (folder / "stated.v").write_text("".join((head, scope, *modules)))
        options = ["-test-mode"] if false else []  # it tells how a command fails
        command = ["coqc", "-q", *options, "-Q", THEORY, "Trackably", "stated.v"]
        return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)

    return compiled


mp.dps = 50


def value(content, name, t):
    """Return a bounded state or input at a time, in many digits."""
    return naive.exactly(decode(Reference, content["reference"]), name, t)


def highest(content, name, until):
    """Return where a state or an input is largest on [0, until], as a float64, and its value there in many digits."""
    reference = decode(Reference, content["reference"])
    return max(
        ((t, naive.exactly(reference, name, t)) for t in naive.extremes(reference, name, 0.0, until)), key=itemgetter(1)
    )


def drawn_in(name, side):
    """Return a certificate whose bound of the state or the input is a millionth below the largest value, and where."""
    content = certificate(name)
    at, top = highest(content, side, 1.2)
    content["reference"]["plant"][f"{side}_set"]["upper"] = [bound := float(top - mpf("1e-6"))]
    return content, side, at, bound


def elementary(kind, **more):
    return {"type": kind, "signal_std": 0.7, "lengthscale": 0.3, **more}


PERIODIC = elementary("periodic", period=1.7)
KERNELS = {
    "periodic": PERIODIC,
    "a sum": {"type": "sum", "left": elementary("matern52"), "right": elementary("squared_exponential")},
    "a product": {"type": "product", "left": PERIODIC, "right": elementary("matern32")},
}


def with_kernel(kernel, margin):
    """Return a certificate with this kernel whose bound is this far above the largest state, and where that is."""
    content = certificate("example1/joint")
    (z,) = content["reference"]["signals"]
    z.update(kernel=kernel, mean=0.25, centres=[0.0, 0.15, 0.4, 0.5], weights=[0.3, -1.1, 1.2, 0.4])
    plant = content["reference"]["plant"]
    plant["input_set"].update(lower=[-9.0], upper=[9.0])
    if kernel is PERIODIC:
        del content["claim"]["tail_start"]
        content["claim"] |= {"kind": "all_phases", "period": 1.7}
    at, top = highest(content, "state", 1.7)
    plant["state_set"]["upper"] = [bound := float(top + mpf(margin))]
    return content, "state", at, bound


@cache
def faults():
    """Certificates whose statement is false: the content, what leaves its bound, when, and the bound."""
    examples = (drawn_in("example1/joint", side) for side in ("state", "input"))
    return [*examples, *(with_kernel(kernel, "-1e-6") for kernel in KERNELS.values())]


def as_counterexample(content, quantity, at):
    header = {"format": "trackably counterexample", "version": 1, "claim": {"kind": content["claim"]["kind"]}}
    said = {name: content[name] for name in ("reference", "trajectories")}
    return {**header, **said, "quantity": quantity, "at": {"time": at}, "violation": 1e-9}


def acceleration_drawn_in():
    """The same of a row of two inputs."""
    content = certificate("vehicle/joint")
    rows = content["reference"]["plant"]["input_set"]
    assert rows["rows"][0] == [1.0, 1.0]
    at, top = highest(content, "ax+ay", 10.0)
    rows["upper"][0] = float(top - mpf("1e-6"))
    return content, at


def plain(*contents):
    return [(content, False, "") for content in contents]


def test_coq_proves_what_is_certified_and_what_is_true_by_a_millionth_and_refutes_what_is_false_by_one(coq):
    robust = (certificate(f"{name}/robust") for name in ("example1", "vehicle"))
    acceleration, then = acceleration_drawn_in()
    answer = coq(
        *plain(certificate("example1/sound"), *(with_kernel(kernel, "1e-6")[0] for kernel in KERNELS.values())),
        *((of, False, "Check trackable_though_disturbed : withstands reference disturbed.\n") for of in robust),
        (with_kernel(PERIODIC, "0.1")[0], True, "Check Emulated.check_sound.\n"),
        *plain(*(as_counterexample(content, name, at) for content, name, at, _ in faults())),
        *plain(as_counterexample(acceleration, "ax+ay", then)),
    )
    assert answer.returncode == 0, answer.stderr


def test_coq_refuses_what_is_false(coq):
    assert all(value(content, name, at) > mpf(bound) for content, name, at, bound in faults())
    false = [*(content for content, *_ in faults()), acceleration_drawn_in()[0], not_the_system(), disturbed_too_much()]
    answer = coq(*plain(*false), false=True)
    said = " ".join((answer.stdout + answer.stderr).split()).split("The command has indeed failed with message:")[1:]
    assert answer.returncode == 0, f"number {len(said)} is accepted: {answer.stderr}"
    assert len(said) == len(false)
    assert all('has type "true = true" while it is expected to have type "Native.check' in each for each in said)


def not_the_system():
    """Trajectories that do not solve the system."""
    content = certificate("example1/joint")
    weights = content["trajectories"]["inputs"][0]["weights"][0]
    assert weights[1] == "2"
    assert abs(value(content, "state", 0.1)) > 0.01  # by so much, times 1e-12, the input before this time is off
    weights[1] = "2000000000001/1000000000000"
    return content


def disturbed_too_much():
    """Disturbances that break a bound."""
    content = certificate("example1/robust")
    disturbance, system = content["disturbance"], content["reference"]["plant"]["system"]
    disturbance["set"]["generators"] = [["1/39"]]
    T, A, B = mpf(system["sampling_time"]), mpf(system["A"][0][0]), mpf(system["B"][0][0])
    start, K = mpf(highest(content, "state", 1.2)[0]) - 3 * T, mpf(disturbance["feedback"][0][0])
    assert A + B * K > 0  # pushes in one direction add up
    x = value(content, "state", start)
    for k in range(3):
        t = start + k * T
        u = value(content, "input", t) + K * (x - value(content, "state", t))
        x = A * x + B * u + mpf(1) / 39
    assert x > mpf(disturbance["state_set"]["upper"][0])
    return content


@pytest.fixture(scope="module")
def extracted(coq, tmp_path_factory):
    """Build the program that Coq extracts from its checker; return what tells its answers of some contents."""
    query = ["ocamlfind", "query", "zarith", "coq-core.kernel"]
    there = shutil.which("ocamlfind") and subprocess.run(query, capture_output=True, text=True, check=False).stdout
    if not there or not Path(there.split()[-1], "kernel.cmxa").exists():  # Coq alone brings no libraries to link with
        pytest.skip("OCaml with Coq's libraries is not installed")
    folder = tmp_path_factory.mktemp("extracted") / "theorem"
    folder.mkdir()
    for file in (*THEORY.glob("*.vo"), THEORY / "Extraction.v", THEORY / "program.ml"):
        shutil.copy(file, folder)
    make = ["make", "--silent", "--file", ROOT / "Makefile", "--old-file", "theorem/Checker.vo", "extracted"]
    subprocess.run(make, cwd=folder.parent, capture_output=True, check=True)

    def decided(content):
        (folder / "given.json").write_text(json.dumps(content))
        (folder / "stated.v").write_text(theorem(folder / "given.json").text)
        command = [folder / "extracted" / "check", folder / "stated.v"]
        answer = subprocess.run(command, capture_output=True, text=True, check=False)
        return answer.returncode, re.findall(r"^  (.*: (?:holds|NOT DECIDED))$", answer.stdout, re.MULTILINE)

    return decided


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("example1/robust", ["holds reference: holds", "withstands reference disturbed: holds"]),
        ("example1/unconstrained.counterexample", ["~ holds reference: holds"]),
        ("vehicle/joint", ["holds reference: holds"]),
    ],
)
def test_the_extracted_checker_accepts_what_coq_proves(extracted, name, said):
    assert extracted(certificate(name)) == (0, said)


def test_the_extracted_checker_refuses_what_is_false(extracted):
    for content, *_ in faults():
        assert extracted(content) == (1, ["holds reference: NOT DECIDED"])


def test_emulated_arithmetic_does_not_trust_the_processor():
    """`make theorem` compares all names; Coq prints those of native arithmetic with what is on record."""
    *_, emulated = (THEORY / "assumptions.txt").read_text().split("Axioms:")
    assert "Uint63" in emulated
    assert "Float" not in emulated


@pytest.mark.usefixtures("coq")
def test_coq_proves_what_is_on_record():
    stated = theorem(file_of("example1/joint"))
    run = run_coq(stated)
    assert run.accepted, run.complaint
    on_record, proved = read_record()["example1"]["joint"], proved_in(stated, run)
    if proved.coq != on_record.coq:  # another version may print it otherwise, and name its axioms otherwise
        proved = Proved(
            **proved.model_dump(exclude={"coq", "axioms", "printed"}),
            **on_record.model_dump(include={"coq", "axioms", "printed"}),
        )
    assert proved == on_record


@pytest.mark.usefixtures("coq")
def test_a_proof_that_rests_on_another_axiom_is_not_recorded():
    stated = theorem(file_of("example1/joint"))
    (only,) = stated.parts
    assumed = f"{only.definition}\nAxiom Assumed : true = true -> holds reference.\n"
    unproved = replace(stated, parts=(replace(only, definition=assumed, lemma="Assumed"),))
    run = run_coq(unproved)
    assert run.accepted, run.complaint
    with pytest.raises(InputError, match="Assumed"):
        proved_in(unproved, run)


def test_all_that_coq_covers_is_on_record():
    for name in ("example1", "example1-resampled", "example2", "hand", "robot-axis", "vehicle"):
        results = Results(name, RESULTS)
        assert {file.stem for file in results.proofs} == set(proved_by_coq(results))


@pytest.mark.parametrize("name", ["example1/joint", "example2/joint", "vehicle/joint"])
def test_each_number_of_the_signals_is_written_exactly(name, tmp_path):
    content = certificate(name)
    text = theorem(file_of(name)).text
    written = [
        (Fraction(int(n), eval(d.replace("^", "**"))), Fraction(int(m), eval(e.replace("^", "**"))))
        for n, d, m, e in re.findall(r"weight := \((-?\d+) # ([\d ^]+)\); centre := \((-?\d+) # ([\d ^]+)\)", text)
    ]
    signals = content["reference"]["signals"]
    assert written == [
        (Fraction(c), Fraction(t)) for z in signals for c, t in zip(z["weights"], z["centres"], strict=True)
    ]


def test_what_coq_does_not_cover_is_refused_in_a_sentence(tmp_path):
    with pytest.raises(InputError, match=r"Coq covers linear systems .*, not formulas"):
        theorem(file_of("tank/joint"))
    content = json.loads(file_of("example1/joint").read_text())
    (end,) = content["reference"]["plant"]["state_set"]["upper"]
    moving = {"breakpoints": [0.0, 1.0], "coefficients": [[end]], "beyond": "rest"}
    content["reference"]["plant"]["state_set"]["upper"] = [moving]
    (moves := tmp_path / "moves.json").write_text(json.dumps(content))
    with pytest.raises(InputError, match="Coq covers constant bounds only, but a bound in this file moves in time"):
        theorem(moves)
    (table := tmp_path / "table.json").write_text('{"format": "trackably refuted table", "version": 1}')
    with pytest.raises(InputError, match=r"Coq covers certificates .* but this is a 'trackably refuted table'"):
        theorem(table)


def test_the_command_writes_the_file_and_says_what_it_leaves_out(tmp_path, capsys):
    output = tmp_path / "example.v"
    file = file_of("example1/joint")
    assert main(["theorem", str(file), "--output", str(output)]) == 0
    assert output.read_text() == theorem(file).text
    printed = capsys.readouterr().out
    assert "coqc -Q theorem Trackably" in printed
    assert "nothing about evaluation in float64" in printed
