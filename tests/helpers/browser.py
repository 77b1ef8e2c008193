"""Headless Chromium for tests of pages; where there is none the test says so by being skipped."""

import os
import shutil
from contextlib import contextmanager
from pathlib import Path

import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome")
WIDTHS = (1280, 390)


@contextmanager
def chromium():
    """A browser, without a display and without the sandbox that root cannot have."""
    playwright = pytest.importorskip(
        "playwright.sync_api", reason="playwright is not installed: pip install -e .[test]"
    )
    path = next(filter(None, map(shutil.which, NAMES)), None)
    if path is None:
        pytest.skip("no Chromium here: apt install chromium (make test does it)")
    with playwright.sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=path, args=["--no-sandbox"] if os.getuid() == 0 else [])
        try:
            yield browser
        finally:
            browser.close()


def inspect(browser, file: Path, width: int, picture: Path | None = None) -> dict:
    """What a page does at a width: messages, requests beyond itself, pictures without content, what overflows."""
    page = browser.new_page(viewport={"width": width, "height": 900})
    messages, requests = [], []
    page.on("console", lambda message: messages.append(message.text))
    page.on("pageerror", lambda error: messages.append(str(error)))
    page.on("request", lambda request: requests.append(request.url))
    page.goto(file.resolve().as_uri())
    seen = page.evaluate(
        """() => ({
            images: [...document.images].map(i => {
                const canvas = document.createElement('canvas');
                canvas.width = canvas.height = 40;
                const pen = canvas.getContext('2d');
                pen.fillStyle = 'white'; pen.fillRect(0, 0, 40, 40);
                if (i.naturalWidth) pen.drawImage(i, 0, 0, 40, 40);
                const bytes = pen.getImageData(0, 0, 40, 40).data;
                return {alt: i.alt, shown: i.clientWidth, lightest: Math.max(...bytes.filter((_, k) => k % 4 < 3)),
                        darkest: Math.min(...bytes.filter((_, k) => k % 4 < 3))};
            }),
            overflow: [...document.querySelectorAll('body *')]
                .filter(e => e.getBoundingClientRect().right > document.documentElement.clientWidth + 1)
                .map(e => e.tagName + ' ' + e.textContent.slice(0, 40)),
            wide: document.documentElement.scrollWidth,
            headings: [...document.querySelectorAll('h2')].map(h => h.textContent),
        })"""
    )
    if picture:
        page.screenshot(path=picture, full_page=True)
    page.close()
    outside = [url for url in requests if not url.startswith(("data:", file.resolve().as_uri()))]
    return {**seen, "messages": messages, "requests": outside}
