"""The system's browser without a window, and what it shows of a viewer's page."""

import os
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from typing import Any

import numpy as np
import pytest
from PIL import Image

from pipeline.viewer.view import fetched
from tests.project import ROOT
from trackably.errors import InputError

REQUIRED = "BROWSER_TESTS"
"""Environment variable: where it says `required`, a missing browser or viewer is a failure and not a reason to skip."""
PROGRAMS = ("chromium", "chromium-browser", "google-chrome")
PATIENCE = 120.0  # s; a machine under load draws slowly, and reads a browser slowly that it has not opened for long
_PAUSE, _CHANGE = 0.3, 1.0  # s
_COLOURFUL = 40  # difference of channels: where a single value is drawn, few pixels have it


def missing(what: str) -> None:
    """Skip the tests, or fail where they are required."""
    (pytest.fail if os.environ.get(REQUIRED) == "required" else pytest.skip)(what)


def program() -> str:
    found = next(filter(None, map(shutil.which, PROGRAMS)), None)
    if found is None:
        missing(f"there is no browser: none of {', '.join(PROGRAMS)}")
    assert found
    return found


def viewer() -> Any:
    """Return the folder of the viewer, fetched where it is missing."""
    try:
        return fetched(ROOT / ".viewer")
    except InputError as error:
        missing(str(error))


@contextmanager
def opened() -> Iterator[Any]:
    """Give a page of a browser without a window, with the side bar that lists topics."""
    from playwright.sync_api import sync_playwright  # noqa: PLC0415  hundreds of milliseconds, for this test alone

    # The sandbox needs rights that root in a container lacks; the pages are our own.
    options = ["--enable-unsafe-swiftshader", *(["--no-sandbox"] if os.geteuid() == 0 else [])]
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program(), args=options)
        try:
            page = browser.new_page(viewport={"width": 1280, "height": 800})
            side_bar = '{"state": {"sidebarItem": "connection"}, "version": 0}'
            page.set_default_timeout(PATIENCE * 1e3)
            page.add_init_script(f"localStorage.setItem('fox.workspace', '{side_bar}')")
            yield page
        finally:
            browser.close()


def complaints(page: Any, address: str) -> list[str]:
    """Return a list that fills with errors of the page, and with requests to anything but this machine."""
    found: list[str] = []
    own = (address, "data:", f"blob:{address}")
    page.on("console", lambda message: found.append(message.text) if message.type == "error" else None)
    page.on("pageerror", lambda error: found.append(str(error)))
    page.on("request", lambda asked: None if asked.url.startswith(own) else found.append(asked.url))
    return found


def tabs(page: Any) -> list[str]:
    """Return the titles of the tabs once the layout is there."""
    page.wait_for_selector("[data-testid=toolbar-tab]", timeout=PATIENCE * 1e3)
    return [tab.get_attribute("title") for tab in page.locator("[data-testid=toolbar-tab]").all()]


def open_tab(page: Any, title: str) -> None:
    """Open a tab, and wait until the plots of the tab before are gone, a second at most."""
    page.evaluate("document.querySelectorAll('canvas').forEach(canvas => canvas.dataset.before = 'yes')")
    page.locator(f'[data-testid=toolbar-tab][title="{title}"]').click()
    until = time.monotonic() + _CHANGE
    while page.locator("canvas[data-before]").count() and time.monotonic() < until:
        time.sleep(_PAUSE / 4)


def topics(page: Any) -> list[str]:
    """Return the topics that the side bar lists."""
    return page.eval_on_selector_all(
        "li .MuiListItemText-primary[title^='/']", "found => found.map(topic => topic.title)"
    )  # type: ignore[no-any-return]


def empty_canvases(page: Any) -> list[int]:
    """Return the numbers of those canvases on which nothing in colour is drawn; grids and axes are grey."""
    boxes = page.eval_on_selector_all(
        "canvas", "found => found.map(c => c.getBoundingClientRect()).map(r => [r.left, r.top, r.right, r.bottom])"
    )
    if not boxes:
        return [-1]
    red, green, blue = map(np.asarray, Image.open(BytesIO(page.screenshot())).convert("RGB").split())
    brightest, darkest = np.maximum(np.maximum(red, green), blue), np.minimum(np.minimum(red, green), blue)
    colourful = brightest - darkest > _COLOURFUL
    return [
        number
        for number, (left, top, right, bottom) in enumerate([[round(side) for side in box] for box in boxes])
        if not colourful[top:bottom, left:right].any()
    ]


def wait_until_drawn(page: Any, title: str) -> None:
    """Return when something is drawn in each plot of a tab. Fails when patience is at its end."""
    open_tab(page, title)
    until = time.monotonic() + PATIENCE
    while empty := empty_canvases(page):
        assert time.monotonic() < until, f"{title}: nothing is drawn in the plots {empty}"
        time.sleep(_PAUSE)
