"""How references are learned: one table of methods, each with what it claims of its reference."""

from pipeline.methods.model import Claims, Failed, Fit, Method, Task
from pipeline.methods.parameters import Algorithm1, Parameters, Periodic
from pipeline.methods.table import (
    AS_PUBLISHED,
    EXACT,
    GRID,
    HYPERPARAMETERS,
    INTERVALS,
    JOINT,
    METHODS,
    REQUIRED,
    ROBUST,
    SAMPLED,
    SOUND,
    UNCONSTRAINED,
    methods_in_figures,
)

__all__ = [
    "AS_PUBLISHED",
    "EXACT",
    "GRID",
    "HYPERPARAMETERS",
    "INTERVALS",
    "JOINT",
    "METHODS",
    "REQUIRED",
    "ROBUST",
    "SAMPLED",
    "SOUND",
    "UNCONSTRAINED",
    "Algorithm1",
    "Claims",
    "Failed",
    "Fit",
    "Method",
    "Parameters",
    "Periodic",
    "Task",
    "methods_in_figures",
]
