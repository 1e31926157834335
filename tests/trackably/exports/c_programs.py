"""Headers of references in one program, compiled by the system's C compiler, and asked for values at times."""

import shutil
import subprocess
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from trackably.arrays import Array
from trackably.exports.c99 import header
from trackably.exports.proved import Proved

CC = shutil.which("cc")
STRICT = ["-std=c99", "-pedantic", "-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-Werror", "-O2"]

_MAIN = """
int main(void)
{{
    char called[64];
    double t;
    while (scanf("%63s %la", called, &t) == 2) {{
        double x[8] = {{0.0}}, u[8] = {{0.0}};
        int refused = -1, n = 0, m = 0;
{cases}
        printf("%d", refused);
        for (int i = 0; i < n; ++i) printf(" %a", x[i]);
        for (int i = 0; i < m; ++i) printf(" %a", u[i]);
        printf("\\n");
    }}
    return 0;
}}
"""
_CASE = """\
        if (!strcmp(called, "{name}_at")) refused = {name}_at(t, x, u);
        if (!strcmp(called, "{name}_step")) refused = {name}_step((long long)t, x, u);
        if (!strncmp(called, "{name}_", {size})) {{ n = {n}; m = {m}; }}
"""


def compiled(references: Mapping[str, Proved], folder: Path, options: tuple[str, ...] = ()) -> Path:
    """Compile a program that reads functions and times, and prints whether a time is refused, and all values."""
    includes, cases = "", ""
    for name, proved in references.items():
        (folder / f"{name}.h").write_text(header(proved, name), encoding="utf-8")
        includes += f'#include "{name}.h"\n'
        system = proved.reference.plant.system
        cases += _CASE.format(name=name, size=len(name) + 1, n=len(system.states), m=len(system.inputs))
    (folder / "main.c").write_text(f"{includes}#include <stdio.h>\n#include <string.h>\n{_MAIN.format(cases=cases)}")
    command = [CC, *STRICT, *options, "-o", "program", "main.c", "-lm"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return folder / "program"


def run(program: Path, function: str, times: Array) -> tuple[Array, Array]:
    """Return which times are refused, shape (K,), and states and inputs, shape (K, n + m)."""
    given = "\n".join(f"{function} {t.hex()}" for t in np.asarray(times, dtype=float).tolist())
    done = subprocess.run([program], input=given, capture_output=True, text=True, check=True)
    rows = [line.split() for line in done.stdout.splitlines()]
    assert len(rows) == len(times)
    return np.array([row[0] == "1" for row in rows]), np.array([[float.fromhex(v) for v in row[1:]] for row in rows])
