"""Take the README's picture of the viewer: `python -m tests.pipeline.viewer.picture`."""

import time
from io import BytesIO

from PIL import Image

from pipeline.experiments import load_experiment
from pipeline.storage.results import Results
from pipeline.viewer.view import shown
from tests.pipeline.viewer import browser
from tests.pipeline.viewer.background import serving
from tests.project import ROOT

PICTURE = ROOT / "pipeline" / "viewer" / "picture.png"
EXPERIMENT, TAB = "vehicle", "Scene"
_WHEN = 0.13  # of the log's duration
_LOADED = 8.0  # s
_COLOURS = 64


def main() -> None:
    """Open the scene some seconds into the log, without the side bar, and save it with few colours."""
    results = Results(EXPERIMENT, ROOT / "data" / "results")
    experiment = load_experiment(EXPERIMENT, ROOT / "params.yaml")
    with serving(shown(experiment, results, browser.viewer())) as address, browser.opened() as page:
        page.set_viewport_size({"width": 1200, "height": 720})
        page.add_init_script("localStorage.removeItem('fox.workspace')")
        page.goto(address)
        browser.tabs(page)
        browser.wait_until_drawn(page, TAB)
        time.sleep(_LOADED)
        size = page.viewport_size
        page.mouse.click(8 + _WHEN * (size["width"] - 16), size["height"] - 57)
        page.mouse.move(2, 2)
        time.sleep(_LOADED)
        picture = Image.open(BytesIO(page.screenshot())).convert("RGB")
    buffer = BytesIO()
    picture.quantize(_COLOURS).save(buffer, "PNG", optimize=True)
    PICTURE.write_bytes(buffer.getvalue())


if __name__ == "__main__":
    main()
