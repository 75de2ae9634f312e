"""A headless Chromium of this system, steered by Playwright, for pages of this machine."""

from __future__ import annotations

import io
import re
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from PIL import Image
from playwright.sync_api import ConsoleMessage, Page, Request, sync_playwright

from pipeline.base.errors import UserError

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
OPTIONS = [
    "--disable-gpu", "--hide-scrollbars", "--no-proxy-server",
    "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",
]  # fmt: skip
LOCAL = re.compile(r"(https?|wss?)://(127\.0\.0\.1|localhost)[:/]|data:|blob:|about:|file:")
SHOWN = "texts => texts.every(text => document.body?.innerText.includes(text))"


class Browser:
    """One page, and what it did that it should not.

    Attributes:
        elsewhere: Addresses that it asked for and that are not on this machine; not those that the
            content policy of the page or its server forbids.
        errors: What it wrote to the console as an error, with what the content policy forbade.
    """

    def __init__(self, page: Page) -> None:
        self.page, self.elsewhere, self.errors = page, set(), []
        page.on("request", self._asks)
        page.on("requestfailed", self._fails)
        page.on("console", self._says)
        page.on("pageerror", lambda error: self.errors.append(str(error)))

    def _says(self, message: ConsoleMessage) -> None:
        if message.type == "error":
            self.errors.append(message.text)

    def _asks(self, request: Request) -> None:
        if not LOCAL.match(request.url):
            self.elsewhere.add(request.url)

    def _fails(self, request: Request) -> None:
        if "csp" in (request.failure or "").lower():
            self.elsewhere.discard(request.url)

    def open(self, url: str, *texts: str, settling: float = 2.0) -> None:
        """Open a page, wait for `texts`, and `settling` more [s] for what moves into its place."""
        self.page.goto(url)
        self.page.wait_for_function(SHOWN, arg=list(texts))
        self.page.wait_for_timeout(1e3 * settling)

    def shoot(self, path: Path, height: int | None = None) -> None:
        """Save what is seen, or its upper part, as PNG of 256 colours."""
        image = Image.open(io.BytesIO(self.page.screenshot())).convert("RGB")
        image = image.crop((0, 0, image.width, height or image.height))
        path.parent.mkdir(parents=True, exist_ok=True)
        image.quantize(256, method=Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE).save(
            path, optimize=True
        )


@contextmanager
def browsing(width: int = 1360, height: int = 1010) -> Iterator[Browser]:
    """A browser while the block lasts. Raises UserError where this system has none."""
    program = next(filter(None, map(shutil.which, NAMES)), None)
    if program is None:
        raise UserError(f"no Chromium ({', '.join(NAMES)}); install one: apt install chromium")
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(
            executable_path=program, args=OPTIONS, chromium_sandbox=False
        )
        yield Browser(chromium.new_page(viewport={"width": width, "height": height}))
        chromium.close()
