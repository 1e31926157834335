"""What `pip install .` brings: the library alone, and nothing that only some users or the staged scripts need."""

import os
import re
import subprocess
import sys
import tomllib
from email import message_from_bytes
from pathlib import Path
from zipfile import ZipFile

import pytest

from tests.imports import COMPUTED, imported, roots
from tests.project import ROOT
from trackably.extras import EXTRA_OF

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
CALLED = {  # names of distributions, where modules are called otherwise
    "google": "protobuf",
    "mcap_protobuf": "mcap-protobuf-support",
    "mcap_ros2": "mcap-ros2-support",
    "ruamel": "ruamel.yaml",
}
PARTS = {"docutils": "sphinx", "pydantic_core": "pydantic", "traitlets": "nbclient"}  # of a package that is named
# Jupyter is a command, and Sphinx's configuration names its extensions and theme.
BY_NAME_ONLY = {"jupyter", "myst-nb", "furo"}
OPTIONAL = {CALLED.get(name, name).replace("_", "-"): extra for name, extra in EXTRA_OF.items()} | {
    "ruamel.yaml": "pipeline"  # files in YAML are read where it is installed
}
README = (ROOT / "README.md").read_text(encoding="utf-8")


def required(requirements):
    return {re.split(r"[<>=!~;\[ ]", requirement)[0] for requirement in requirements}


def used_by(package):
    found = roots(imported(ROOT / package)) - {*sys.stdlib_module_names, "trackably", "pipeline", COMPUTED}
    return {CALLED.get(name, PARTS.get(name, name)) for name in found}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wheel")
    build = [sys.executable, "-m", "hatchling", "build", "--target", "wheel", "--directory", str(folder)]
    subprocess.run(build, cwd=ROOT, check=True, capture_output=True)
    (path,) = folder.glob("*.whl")
    return ZipFile(path)


def test_the_wheel_holds_the_library_and_nothing_else(wheel):
    shipped = {name for name in wheel.namelist() if ".dist-info/" not in name}
    tracked = {path.relative_to(ROOT).as_posix() for path in (ROOT / "trackably").rglob("*.py")}
    assert {name for name in shipped if name.endswith(".py")} == tracked
    assert all(Path(name).parts[0] == "trackably" for name in shipped)
    assert "trackably/exports/trackably.mplstyle" in shipped


def test_without_an_extra_it_requires_what_the_library_imports(wheel):
    (name,) = (name for name in wheel.namelist() if name.endswith(".dist-info/METADATA"))
    metadata = message_from_bytes(wheel.read(name))
    every = metadata.get_all("Requires-Dist", [])
    plain = required([requirement for requirement in every if "extra ==" not in requirement])
    assert plain == used_by("trackably") - OPTIONAL.keys() == required(PROJECT["dependencies"])
    assert plain <= {"numpy", "scipy", "clarabel", "mpmath", "tqdm", "threadpoolctl"}
    assert {*metadata.get_all("Provides-Extra", [])} == {"all", *OPTIONAL.values()}


def test_each_optional_package_is_in_the_extra_that_its_error_names():
    extras = PROJECT["optional-dependencies"]
    assert used_by("trackably") >= OPTIONAL.keys()
    for extra in {*OPTIONAL.values()} - {"pipeline"}:
        assert {name for name in OPTIONAL if OPTIONAL[name] == extra} == required(extras[extra]) - BY_NAME_ONLY
    assert extras["all"] == [f"trackably[{','.join(sorted({*OPTIONAL.values()} - {'pipeline'}))}]"]


def test_the_extra_has_what_the_stages_import_beside_it():
    extra, library = required(PROJECT["optional-dependencies"]["pipeline"]), required(PROJECT["dependencies"])
    assert not extra & library
    assert used_by("pipeline") - library - (OPTIONAL.keys() - extra) == extra - BY_NAME_ONLY - OPTIONAL.keys()


WITHOUT_EXTRAS = f"""
import sys

class Missing:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {sorted({*EXTRA_OF, "pandas", "IPython", "ruamel", "pydantic", "click"})}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)

sys.meta_path.insert(0, Missing())
"""


def run_without_extras(code, folder):
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", WITHOUT_EXTRAS + code],
        cwd=folder, env=environment, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_readme_runs_without_extras_and_without_a_warning(tmp_path):
    (code,) = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    said = run_without_extras(code, tmp_path)
    assert "proved for all real t ≥ 0: state in [" in said


def test_public_names_need_no_extra_or_say_which_one(tmp_path):
    code = """
import trackably
for name in trackably.__all__:
    try:
        getattr(trackably, name)
    except ImportError as error:
        print(error)
"""
    said = run_without_extras(code, tmp_path).splitlines()
    sentence = r"(\w+): needs the package '\w+', which is not installed: pip install 'trackably\[(\w+)\]'"
    found = {match[1]: match[2] for line in said if (match := re.fullmatch(sentence, line))}
    assert len(found) == len(said)
    assert found["read_mcap"] == "recordings"
    assert {"learn_reference", "check", "certify", "read_csv", "learn_many"}.isdisjoint(found)
