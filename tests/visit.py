"""A page in the system's Chromium, for tests."""

import os
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest

from pipeline.base.errors import UserError

DESKTOP, PHONE = 1360, 390  # widths [px]


@contextmanager
def visited(page: Path, width: int = DESKTOP) -> Iterator:
    """The page of a file, as a tools.browser.Browser that showed it, while the block lasts.

    Skips the test where there is no browser, unless SLING_BROWSER=required (`make validate`).
    """
    with ExitStack() as stack:
        try:
            from tools.browser import browsing

            browser = stack.enter_context(browsing(width=width))
        except (ImportError, UserError) as error:
            if os.environ.get("SLING_BROWSER") == "required":
                raise
            pytest.skip(str(error))
        browser.open(page.as_uri(), settling=0.5)
        yield browser


def overflow(browser) -> int:
    """By how many pixels the page is wider than the window."""
    width = "document.documentElement.scrollWidth - document.documentElement.clientWidth"
    return browser.page.evaluate(width)
