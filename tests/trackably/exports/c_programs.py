"""Headers of references, compiled by the system's C compiler, and asked for values at times."""

import shutil
import subprocess
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
    double t;
    while (scanf("%la", &t) == 1) {{
        double x[{n}] = {{0.0}}, u[{m}] = {{0.0}};
        const int refused = {call};
        printf("%d", refused);
        for (int i = 0; i < {n}; ++i) printf(" %a", x[i]);
        for (int i = 0; i < {m}; ++i) printf(" %a", u[i]);
        printf("\\n");
    }}
    return 0;
}}
"""


def compiled(proved: Proved, folder: Path, call: str = "reference_at(t, x, u)", options: tuple[str, ...] = ()) -> Path:
    """Compile a program that reads times and prints, for each, whether it is refused and all values."""
    system = proved.reference.plant.system
    main = _MAIN.format(n=len(system.states), m=len(system.inputs), call=call)
    (folder / "reference.h").write_text(header(proved, "reference"), encoding="utf-8")
    (folder / "main.c").write_text(f'#include "reference.h"\n#include <stdio.h>\n{main}')
    assert CC is not None
    command = [CC, *STRICT, *options, "-o", "program", "main.c", "-lm"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return folder / "program"


def run(program: Path, times: Array) -> tuple[Array, Array]:
    """Return which times are refused, shape (K,), and states and inputs, shape (K, n + m)."""
    given = "\n".join(t.hex() for t in times.tolist())
    done = subprocess.run([program], input=given, capture_output=True, text=True, check=True)
    rows = [line.split() for line in done.stdout.splitlines()]
    assert len(rows) == len(times)
    return np.array([row[0] == "1" for row in rows]), np.array([[float.fromhex(v) for v in row[1:]] for row in rows])
