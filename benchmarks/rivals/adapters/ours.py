"""Algorithm 1 as published, and this project: hyperparameters alone, and function and hyperparameters together."""

from functools import partial

from benchmarks.rivals.curves import curve_of
from benchmarks.rivals.model import Found, NotFound, Problem
from pipeline.methods import AS_PUBLISHED, Fit
from trackably.certificates.certificate import Certificate
from trackably.certificates.certified import Certified, learn_certified
from trackably.certificates.claim import times_of
from trackably.learning import learner
from trackably.learning.learner import Learner
from trackably.learning.problem import NoSolution
from trackably.systems.reference import Reference


def solve(how: Learner, problem: Problem) -> Found:
    """Learn with a proof of the problem's claim; infeasible, unproved and found are three answers."""
    task = problem.task
    found = learn_certified(task.problem, task.plant, task.goal, learner=how)
    if not isinstance(found, Certified):
        raise NotFound("infeasible" if isinstance(found, NoSolution) else "unproved", found.explanation)
    solution = found.solution
    return Found(
        curve_of(found.reference.signals, problem),
        solution.objective,
        "J = l + D" if solution.method == "joint" else "l(θ)",
        prior=solution.posterior.prior,
        says=f"proved for {times_of(found.certificate.claim)}",
    )


def as_published(problem: Problem) -> Found:
    """Learn by Algorithm 1, and prove what it claims: sampling instants."""
    task = problem.task
    try:
        AS_PUBLISHED.check(task.plant, task.prior)
    except ValueError as refused:
        raise NotFound("does not apply", str(refused)) from refused
    if missing := [block for block in AS_PUBLISHED.needs if getattr(problem.experiment, block) is None]:
        raise NotFound("does not apply", f"is not for this kind of claim (it needs {', '.join(missing)})")
    found = AS_PUBLISHED.learn(task)
    if not isinstance(found, Fit):
        raise NotFound("infeasible", found.explanation)
    reference = Reference(found.solution.signals, task.plant)
    proof = AS_PUBLISHED.prove(task.goal, reference)
    says = f"proved for {proof.claim}" if isinstance(proof, Certificate) else f"not proved: {proof.explanation}"
    curve, prior = curve_of(reference.signals, problem), found.solution.posterior.prior
    return Found(curve, found.solution.objective, "l(θ)", prior=prior, says=says)


alone, joint = partial(solve, learner.HYPERPARAMETERS), partial(solve, learner.JOINT)
