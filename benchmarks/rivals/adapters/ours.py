"""Algorithm 1 as published, and this project: hyperparameters alone, and function and hyperparameters together."""

from functools import partial

from benchmarks.rivals.curves import curve_of
from benchmarks.rivals.model import Answer, Found, NotFound, Problem, Promise, Rival
from pipeline.methods import AS_PUBLISHED, Fit
from trackably.certificates.certificate import Certificate
from trackably.certificates.certified import Certified, learn_certified
from trackably.certificates.claim import times_of
from trackably.learning import learner
from trackably.learning.learner import Learner
from trackably.learning.problem import NoSolution
from trackably.systems.reference import Reference


def solve(how: Learner, problem: Problem) -> Answer:
    """Learn with a proof of the problem's claim; infeasible, unproved and found are three answers."""
    task = problem.task
    found = learn_certified(task.problem, task.plant, task.goal, learner=how)
    if not isinstance(found, Certified):
        return NotFound("infeasible" if isinstance(found, NoSolution) else "unproved", found.explanation)
    solution = found.solution
    return Found(
        curve_of(found.reference.signals, problem),
        solution.objective,
        "J = l + D" if solution.method == "joint" else "l(θ)",
        prior=solution.posterior.prior,
        says=f"proved for {times_of(found.certificate.claim)}",
    )


def solve_as_published(problem: Problem) -> Answer:
    """Learn by Algorithm 1, and prove what it claims: sampling instants."""
    task = problem.task
    try:
        AS_PUBLISHED.check(task.plant, task.prior)
    except ValueError as refused:
        return NotFound("does not apply", str(refused))
    if missing := [block for block in AS_PUBLISHED.needs if getattr(problem.experiment, block) is None]:
        return NotFound("does not apply", f"is not for this kind of claim (it needs {', '.join(missing)})")
    found = AS_PUBLISHED.learn(task)
    if not isinstance(found, Fit):
        return NotFound("infeasible", found.explanation)
    reference = Reference(found.solution.signals, task.plant)
    proof = AS_PUBLISHED.prove(task.goal, reference)
    says = f"proved for {proof.claim}" if isinstance(proof, Certificate) else f"not proved: {proof.explanation}"
    curve, prior = curve_of(reference.signals, problem), found.solution.posterior.prior
    return Found(curve, found.solution.objective, "l(θ)", prior=prior, says=says)


_PROMISE = Promise("", "this project", "bounds at all times, with a proof in a file")

ALGORITHM_1 = Rival(
    "j",
    "Algorithm 1 as published",
    Promise("", "Matschek et al., IFAC 2020, Algorithm 1", "bounds at all sampling instants"),
    solve_as_published,
)
HYPERPARAMETERS = Rival("k", "ours, θ alone", _PROMISE, partial(solve, learner.HYPERPARAMETERS))
JOINT = Rival("k", "ours, joint", _PROMISE, partial(solve, learner.JOINT))
