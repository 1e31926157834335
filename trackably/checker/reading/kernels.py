"""Read kernels by the names in the registry."""

from dataclasses import fields

from trackably.checker.kernels.base import Kernel
from trackably.checker.kernels.combinations import Combination
from trackably.checker.kernels.registry import COMBINATIONS, ELEMENTARY
from trackably.checker.limits import KERNEL_DEPTH, KERNELS
from trackably.checker.reading.values import Fields, UnreadableError, positive_number, tag_of


def a_kernel(value: object, where: str) -> Kernel:
    """Read a kernel: an object with its type and exactly its positive hyperparameters, or the two parts it combines."""
    found = _kernel(value, where, KERNEL_DEPTH)
    if (count := _count(found)) > KERNELS:
        raise UnreadableError(f"{where} must be made of no more than {KERNELS} kernels, got {count}")
    return found


def _count(kernel: Kernel) -> int:
    return _count(kernel.left) + _count(kernel.right) if isinstance(kernel, Combination) else 1


def _kernel(value: object, where: str, deepest: int) -> Kernel:
    kind = tag_of(value, where, "type", {**ELEMENTARY, **COMBINATIONS})
    if not deepest:
        raise UnreadableError(f"{where} must not be nested more than {KERNEL_DEPTH} deep")
    if kind in COMBINATIONS:
        parts = Fields(value, where, "type", "left", "right")

        def part(inner: object, at: str) -> Kernel:
            return _kernel(inner, at, deepest - 1)

        return COMBINATIONS[kind](parts("left", part), parts("right", part))
    names = [field.name for field in fields(ELEMENTARY[kind])]
    found = Fields(value, where, "type", *names)
    return ELEMENTARY[kind](*(found(name, positive_number) for name in names))
