"""Methods under disturbances: each as it is without them, within bounds that are drawn in."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

from pipeline.methods.model import Failed, Fit, Method, Task


def robustly(method: Method, name: str) -> Method:
    """Return the method that learns in the same way, with room for every error that disturbances may cause."""
    return replace(
        method,
        name=name,
        learn=partial(_within_tightened_bounds, method.learn),
        needs=(*method.needs, "disturbance"),
        looks_like=None,
        is_robust=True,
    )


def _within_tightened_bounds(learn: Callable[[Task], Fit | Failed], task: Task) -> Fit | Failed:
    assert task.tightening, "the experiment was checked for what its methods need"
    return learn(replace(task, plant=task.tightening.plant))
