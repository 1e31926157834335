"""Algorithm 1 as published, and this project: hyperparameters alone, and function and hyperparameters together."""

from collections.abc import Callable
from functools import partial

from benchmarks.rivals.judge.kernels import KernelCurve
from benchmarks.rivals.model import Answer, Found, NotFound, Problem, Promise, Rival
from pipeline.methods import METHODS
from pipeline.methods.model import Failed
from trackable.certificates.certificate import Certificate
from trackable.systems.reference import Reference


def solve(method: str, problem: Problem) -> Answer:
    """Learn by a method of this project; a reference is proved as the method claims it."""
    entry, task = METHODS[method], problem.task
    try:
        entry.check(task.plant, task.prior)
    except ValueError as refused:
        return NotFound("does not apply", str(refused))
    if missing := [block for block in entry.needs if getattr(problem.experiment, block) is None]:
        return NotFound("does not apply", f"is not for this kind of claim (it needs {', '.join(missing)})")
    found = entry.learn(task)
    if isinstance(found, Failed):
        return NotFound("infeasible", found.explanation)
    reference = Reference(found.solution.signals, task.plant)
    proof = entry.prove(task.goal, reference)
    says = f"proved for {proof.claim}" if isinstance(proof, Certificate) else f"not proved: {proof.explanation}"
    return Found(
        KernelCurve(reference, task.samples),
        found.solution.objective,
        "J = l + D" if method == "joint" else "l(θ)",
        prior=found.solution.posterior.prior,
        says=says,
    )


def _rival(letter: str, name: str, method: str, promise: str) -> Rival:
    learn: Callable[[Problem], Answer] = partial(solve, method)
    return Rival(letter, name, Promise("", "this project", promise), learn)


ALGORITHM_1 = Rival(
    "j",
    "Algorithm 1 as published",
    Promise("", "Matschek et al., IFAC 2020, Algorithm 1", "bounds at all sampling instants"),
    partial(solve, "as_published"),
)
HYPERPARAMETERS = _rival("k", "ours, θ alone", "hyperparameters", "bounds at all times, with a proof in a file")
JOINT = _rival("k", "ours, joint", "joint", "bounds at all times, with a proof in a file")
