"""Each page has the block that its code or its results make."""

import pytest

from sling2sim2real.base.errors import UserError
from tests.project import ROOT
from validation import pages


@pytest.mark.parametrize("page", pages.BLOCKS)
def test_a_page_has_its_block(page: str) -> None:
    text = (ROOT / page).read_text(encoding="utf-8")
    assert pages.drawn(page) == text, "run `python -m validation.pages --fix`"


def test_a_page_without_marks_is_refused(tmp_path) -> None:
    (tmp_path / "README.md").write_text("<!-- landings: begin -->\n")
    with pytest.raises(UserError, match="README.md: has not one .*begin.* and one .*end"):
        pages.drawn("README.md", tmp_path)
