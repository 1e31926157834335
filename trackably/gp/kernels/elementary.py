"""Kernels whose dataclass fields are their hyperparameters."""

import dataclasses
import inspect
from collections.abc import Callable, Iterator
from functools import cache
from typing import Self

from trackably.gp.hyperparameter import Hyperparameter, Scales, Search, shown, with_next
from trackably.gp.kernels.base import Kernel


class Elementary(Kernel):
    """A kernel whose dataclass fields are its hyperparameters, each a `Hyperparameter`."""

    @property
    def hyperparameters(self) -> dict[str, float]:
        values = vars(self)
        return {name: values[name] for name in _fields(type(self))}

    def __new__(cls, *given: object, **named: object) -> Self:
        """Refuse unknown hyperparameters here: Python's own message would name the base class that has the fields."""
        known = _fields(cls)
        if named and (unknown := next((name for name in named if name not in known), None)):
            raise TypeError(f"{cls.__name__} has no hyperparameter {unknown!r}; it has {', '.join(known)}")
        if len(given) > len(known):
            raise TypeError(f"{cls.__name__} takes {', '.join(known)}, got {len(given)} values")
        return super().__new__(cls)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(f'{name}={shown(v)}' for name, v in self.hyperparameters.items())})"

    def changed(self, change: Callable[[str, float], float]) -> Self:
        return type(self)(*[change(name, value) for name, value in self.hyperparameters.items()])

    def moved(self, values: Iterator[float]) -> Self:
        moved = object.__new__(type(self))
        vars(moved).update({name: with_next(value, values) for name, value in self.hyperparameters.items()})
        return moved

    def search(self, name: str, scales: Scales) -> Search:
        return _fields(type(self))[name].search(scales)


@cache
def _fields(kernel: type[Elementary]) -> dict[str, Hyperparameter]:
    return {field.name: inspect.getattr_static(kernel, field.name) for field in dataclasses.fields(kernel)}
