"""What is shown of each step's outputs, against a finished run whose figures are known."""

import base64
import io
import re

import numpy as np
from PIL import Image

from app.flow.artifacts import artifact
from pipeline.base.files import write_text
from tests.report.run.conftest import BAND, METHOD, root, template

__all__ = ["root", "template"]  # fixtures


def shown(root, step: str, item: str = f"{BAND}-{METHOD}") -> str:
    return artifact(f"{step}@{item}", root)


def picture(text: str, name: str) -> np.ndarray:
    """Pixels of the picture that a text begins with."""
    content = re.match(rf"!\[{name}\]\(data:image/png;base64,([^)]*)\)\n", text)[1]
    pixels = np.asarray(Image.open(io.BytesIO(base64.b64decode(content))).convert("RGB"))
    assert len(np.unique(pixels.reshape(-1, 3), axis=0)) > 10  # something is drawn
    return pixels


def rows(text: str) -> list[list[str]]:
    """Cells of the tables."""
    lines = [line for line in text.splitlines() if line.startswith("| ")]
    return [[cell.strip() for cell in line.strip("|").split(" | ")] for line in lines]


def test_theta_shows_its_search_and_each_parameter_with_its_interval(root) -> None:
    text = shown(root, "theta")
    assert picture(text, "convergence").shape[1] > 500
    values = dict(rows(text))
    assert values["E [kPa]"] == "300 (270 – 330)"
    assert values["friction"] == "0.50, not identifiable"
    assert values["loss"] == "1.2500"
    assert shown(root, "ablation_theta") == text


def test_a_policy_shows_its_training(root) -> None:
    text = shown(root, "policy")
    picture(text, "training")
    assert [row[2:4] for row in rows(text)[2:]] == [["yes", "0.40"]]


def test_trials_show_landing_errors_by_target(root) -> None:
    text = shown(root, "trials")
    picture(text, "landings")
    errors = rows(text)
    assert ["1.725", "2", "0", "2.50", "0.71", "−0.50"] in errors  # misses of 2 and −3 cm
    assert ["2.125", "1", "1", "–", "–", "–"] in errors
    assert ["all", "4", "1", "3.00", "1.00", "1.00"] in errors


def test_an_episode_shows_its_pull(root) -> None:
    picture(shown(root, "episode", BAND), "pull")


def test_the_report_shows_its_tables_without_links_to_files(root) -> None:
    text = "# Report\n\n## What came out\n\n![all](figures/landings.png)\n\n- good\n"
    text += "\n## The paper's tables\n\n[CSV](tables/table1.csv),"
    write_text(root / "reports" / "README.md", f"{text} [law](https://x.org)\n\n## band1\n\nmore\n")
    tables = "## The paper's tables\n\nCSV, [law](https://x.org)\n"
    assert shown(root, "report", "") == f"## What came out\n\n\n- good\n\n{tables}"


def test_other_steps_show_nothing(root) -> None:
    for step in ("record", "mounting", "history", "clusters", "floor"):
        assert shown(root, step) == ""
