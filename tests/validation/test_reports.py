"""Reports of scripts: what they hold beside their figures."""

import json

import numpy as np

from validation.reports import write_report


def test_a_report_names_its_script_versions_and_commit(tmp_path) -> None:
    """The script is the one that calls."""
    path = tmp_path / "report.json"
    content = {"figures": {"miss_m": np.float64(1 / 3), "none": np.nan}, "cores": "two"}
    report = write_report(path, content, "--page", versions={"own": "1"}, digits=3)
    assert json.loads(path.read_text(encoding="utf-8")) == report
    assert report["command"] == "python -m tests.validation.test_reports --page"
    assert report["figures"] == {"miss_m": 0.333, "none": None}
    assert report["cores"] == "two"  # in the place of the machine's
    assert report["device"] == "cpu" and report["versions"].keys() > {"own", "python", "numpy"}
    assert "commit" in report
