"""The report's page in a browser without a network: no error, no request, nothing too wide."""

import pytest

from pipeline.report.run import write as writing
from tests.visit import DESKTOP, PHONE, overflow, visited

FOREIGN = "new Image().src = 'http://example.invalid/picture.png'"
WIDE = """[...document.querySelectorAll("table")].filter(one => one.scrollWidth > one.clientWidth)
.map(one => getComputedStyle(one).overflowX)"""
LOADED = """[...document.images].map(one => (one.loading = "eager", one.decode()))
.reduce((all, one) => all.then(() => one), Promise.resolve())
.then(() => [...document.images].map(one => one.naturalWidth))"""


@pytest.mark.parametrize("width", [DESKTOP, PHONE])
def test_the_page_runs_alone(root, params, no_simulation, width: int) -> None:
    """On a phone, tables are wider than the window, and scroll within themselves."""
    writing.write(params, root)
    with visited(root / "reports" / "index.html", width) as seen:
        sizes = seen.page.evaluate(LOADED)
        assert len(sizes) > 5 and min(sizes) > 100
        scrolling = seen.page.evaluate(WIDE)
        assert set(scrolling) <= {"auto"} and (scrolling or width == DESKTOP)
        assert seen.errors == [] and seen.elsewhere == set() and overflow(seen) <= 0
        assert seen.page.inner_text("#run").startswith("This run. written: ")
        seen.page.evaluate(FOREIGN)
        seen.page.wait_for_timeout(300)
        assert seen.errors or seen.elsewhere, "a request is not noticed at all"
