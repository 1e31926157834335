"""What source files import, read from their text."""

import ast
from collections.abc import Iterator
from pathlib import Path

COMPUTED = "an import by a computed name"


def imported(folder: Path) -> dict[str, set[str]]:
    """Return for each Python file below a folder, by its path there, the dotted names of all that it imports."""
    return {
        path.relative_to(folder).as_posix(): set(names_in(ast.parse(path.read_text(encoding="utf-8"))))
        for path in sorted(folder.rglob("*.py"))
    }


def roots(files: dict[str, set[str]]) -> set[str]:
    """Return the first parts of all names: the packages that files import."""
    return {name.split(".")[0] for names in files.values() for name in names}


def names_in(tree: ast.AST) -> Iterator[str]:
    """Yield imports on any level: those within functions too, and those by `import_module` with a literal name."""
    for node in ast.walk(tree):
        match node:
            case ast.Import(names=names):
                yield from (alias.name for alias in names)
            case ast.ImportFrom(module=str(module), level=0):
                yield module
            case ast.ImportFrom():
                yield "a relative import"
            case ast.Call(func=ast.Name(id="import_module" | "__import__"), args=[ast.Constant(value=str(name)), *_]):
                yield name
            case ast.Call(func=ast.Name(id="import_module" | "__import__")):
                yield COMPUTED
