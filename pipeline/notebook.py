"""Stage 6: execute the experiment's notebook in place, so that it always shows what the present code does."""

from pathlib import Path
from tempfile import TemporaryDirectory

import nbformat
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError
from traitlets.config import Config

from trackably.errors import InputError
from trackably.files import write_text

NOTEBOOKS = Path("notebooks")
TEMPLATE = NOTEBOOKS / "template.ipynb"
_TIMEOUT = 600  # seconds for one cell


def notebook(name: str) -> None:
    """Execute notebooks/<name>.ipynb in place; if there is none, execute a copy of the template for that experiment.

    The same code, results and packages give the same bytes: there are no times, identifiers are the numbers of cells,
    and the kernel has a fixed name and inherits the environment that `pin` has set. Raises InputError if a cell fails;
    the notebook is then left as it was.
    """
    path = path_of(name)
    source = _read(path if path.exists() else TEMPLATE, name)
    with TemporaryDirectory() as sockets:
        client = NotebookClient(
            source,
            timeout=_TIMEOUT,
            kernel_name="python3",
            record_timing=False,
            coalesce_streams=True,
            shutdown_kernel="immediate",  # the kernel has nothing to save, and a graceful end takes a second
            resources={"metadata": {"path": str(NOTEBOOKS)}},
            # The kernel talks by sockets in a temporary folder, and opens no port.
            config=Config({"KernelManager": {"transport": "ipc", "ip": f"{sockets}/kernel"}}),
        )
        try:
            executed = client.execute()
        except CellExecutionError as error:
            raise InputError(f"{path}: a cell failed, and the notebook was left as it was: {error}") from error
    write_text(path, nbformat.writes(_stable(executed)) + "\n")


def path_of(name: str) -> Path:
    """Return the file of a notebook."""
    return NOTEBOOKS / f"{name}.ipynb"


def _read(path: Path, experiment: str) -> nbformat.NotebookNode:
    try:
        text = path.read_text(encoding="utf-8")
        return nbformat.reads(text.replace("EXPERIMENT", experiment) if path == TEMPLATE else text, as_version=4)
    except (OSError, UnicodeDecodeError, nbformat.reader.NotJSONError, nbformat.ValidationError) as error:
        raise InputError(f"{path}: is not a notebook that can be read: {error}") from error


def _stable(executed: nbformat.NotebookNode) -> nbformat.NotebookNode:
    executed.metadata = {"kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"}}
    for i, cell in enumerate(executed.cells):
        cell.id = f"cell-{i}"
        cell.metadata = {key: value for key, value in cell.metadata.items() if key == "tags"}
    return executed
