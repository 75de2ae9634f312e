"""summary.json in a terminal; test_golden.py holds its numbers."""

import json
from pathlib import Path

import pytest

from sling2sim2real.base.files import write_json
from validation.projects import ProjectCopy

COLUMNS = 120


@pytest.mark.slow
def test_three_bands_fit_a_terminal_and_pictures_need_no_network(tmp_path) -> None:
    """As DVC itself shows them; a plot of data would have its page load Vega."""
    names = "band1_cm", "band2_cm", "band3_cm", "floors", "paper_cm", "failed"
    some = dict.fromkeys((*names, "bias_%", "in_90_%", "width_%"), -1.25)
    write_json(tmp_path / "reports" / "summary.json", some)
    (tmp_path / "reports" / "figures").mkdir()
    (tmp_path / "reports" / "figures" / "one.png").write_bytes(b"\x89PNG of bytes")
    plots = "plots:\n  - reports/figures\n"
    assert plots in Path("dvc.yaml").read_text()
    (tmp_path / "dvc.yaml").write_text(f"metrics:\n  - reports/summary.json\n{plots}")
    project = ProjectCopy(tmp_path, COLUMNS=str(COLUMNS))
    project("dvc", "init", "--no-scm", "--quiet")
    lines = project("dvc", "metrics", "show").splitlines()
    assert len(lines) == 2 and max(map(len, lines)) <= COLUMNS
    project("dvc", "plots", "show", "--quiet")
    page = (tmp_path / "dvc_plots" / "index.html").read_text()
    assert "one.png" in page and "http" not in page and "<script" not in page
    assert json.loads((tmp_path / "reports" / "summary.json").read_text()) == some
