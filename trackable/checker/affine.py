"""x⁺ = f(x, u) solved for u, by the rules that the theorem states; nothing is taken from the certificate but f.

A part that is not there is None. Splitting leaves no part of f out: what holds no input ends up in some drift or gain.
"""

from collections.abc import Callable

from trackable.checker.formulas import Formula, operands

_MOST_COUPLED = 3
_Parts = tuple[Formula | None, dict[str, Formula]]
"""Drift and gains."""


class UnsolvableError(ValueError):
    """f is not affine in the inputs, or cannot be solved for them: says why."""


def inputs_of(f: list[Formula], successors: list[str], inputs: list[str]) -> dict[str, Formula]:
    """u in terms of states and successors. UnsolvableError where there is no such formula."""
    split = [_split(tree, set(inputs)) for tree in f]
    rests = [_minus(successor, drift) for successor, (drift, _) in zip(successors, split, strict=True)]
    rows = [{name: gain for name, gain in gains.items() if gain != 0.0} for _, gains in split]
    found: dict[str, Formula] = {}
    left = list(range(len(f)))
    while alone := [i for i in left if len(rows[i]) == 1]:
        left.remove(alone[0])
        [(name, gain)] = rows[alone[0]].items()
        found[name] = ("/", _known(rests[alone[0]]), gain)
        for i in left:
            rests[i] = _minus(rests[i], _times(rows[i].pop(name, None), found[name]))
    if left:
        found |= _cramer([rows[i] for i in left], [rests[i] for i in left], [u for u in inputs if u not in found])
    if set(found) != set(inputs):
        raise UnsolvableError("f does not determine every input")
    return found


def _split(tree: Formula, inputs: set[str]) -> _Parts:
    if isinstance(tree, str) and tree in inputs:
        return None, {tree: 1.0}
    parts = [_split(part, inputs) for part in operands(tree)]
    held = [bool(gains) for _, gains in parts]
    if not any(held):
        return tree, {}
    match tree[0], held:
        case "+", _:
            return _merged(parts[0], parts[1], _plus)
        case "-", _:
            return _merged(parts[0], parts[1], _minus)
        case "*", [False, True]:
            return _each(parts[1], lambda part: _times(tree[1], part))
        case "*" | "/", [True, False]:
            return _each(parts[0], lambda part: _scaled(part, tree))
    raise UnsolvableError(f"f is not affine in {', '.join(sorted(inputs))}")


def _merged(a: _Parts, b: _Parts, combine: Callable[[Formula | None, Formula | None], Formula | None]) -> _Parts:
    return combine(a[0], b[0]), {name: combine(a[1].get(name), b[1].get(name)) for name in {**a[1], **b[1]}}


def _scaled(part: Formula | None, tree: Formula) -> Formula | None:
    """A part of the left side of a product or quotient, times or over the right one."""
    if tree[0] == "*":
        return _times(part, tree[2])
    return None if part is None else ("/", part, tree[2])


def _each(parts: _Parts, change: Callable[[Formula | None], Formula | None]) -> _Parts:
    return change(parts[0]), {name: change(gain) for name, gain in parts[1].items()}


def _cramer(rows: list[dict[str, Formula]], rests: list[Formula | None], inputs: list[str]) -> dict[str, Formula]:
    """What is left when no equation holds one unknown only."""
    if len(inputs) != len(rows) or len(rows) > _MOST_COUPLED:
        raise UnsolvableError(f"f cannot be solved for {', '.join(inputs)}, or couples more than {_MOST_COUPLED}")
    matrix = [[row.get(name) for name in inputs] for row in rows]
    determinant = _known(_determinant(matrix))
    found = {}
    for j, name in enumerate(inputs):
        total = None
        for i, rest in enumerate(rests):
            minor = _determinant([row[:j] + row[j + 1 :] for k, row in enumerate(matrix) if k != i])
            total = (_minus if (i + j) % 2 else _plus)(total, _times(minor, rest))
        found[name] = ("/", _known(total), determinant)
    return found


def _determinant(matrix: list[list[Formula | None]]) -> Formula | None:
    if not matrix:
        return 1.0
    total = None
    for j, entry in enumerate(matrix[0]):
        minor = _determinant([row[:j] + row[j + 1 :] for row in matrix[1:]])
        total = (_minus if j % 2 else _plus)(total, _times(entry, minor))
    return total


def _known(part: Formula | None) -> Formula:
    if part is None:
        raise UnsolvableError("f cannot be solved for its inputs, whatever the states are")
    return part


def _plus(a: Formula | None, b: Formula | None) -> Formula | None:
    return b if a is None else a if b is None else ("+", a, b)


def _minus(a: Formula | None, b: Formula | None) -> Formula | None:
    return a if b is None else ("*", -1.0, b) if a is None else ("-", a, b)


def _times(a: Formula | None, b: Formula | None) -> Formula | None:
    if a is None or b is None:
        return None
    return b if a == 1.0 else a if b == 1.0 else ("*", a, b)
