"""The report's page in a browser without a network: no error, no request, nothing too wide."""

import pytest

from pipeline.report.page import write_page
from pipeline.report.run import write_run
from tests.visit import DESKTOP, PHONE, overflow, visited

FOREIGN = "new Image().src = 'http://example.invalid/picture.png'"


@pytest.mark.parametrize("width", [DESKTOP, PHONE])
def test_the_page_runs_alone(tmp_path, width: int) -> None:
    write_page(tmp_path, "# Report\n\n## In short\n\n| a | b |\n| - | - |\n| 1 | 2 |\n")
    write_run(tmp_path, runs="a test")
    with visited(tmp_path / "index.html", width) as seen:
        about = seen.page.inner_text("#run")
        assert seen.errors == [] and seen.elsewhere == set() and overflow(seen) <= 0
        assert about.startswith("This run. written: ") and "runs: a test" in about
        seen.page.evaluate(FOREIGN)
        seen.page.wait_for_timeout(300)
        assert seen.errors or seen.elsewhere, "a request is not noticed at all"
