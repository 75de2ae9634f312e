"""`sling remove-band`: what it removes, what it leaves, what it refuses."""

import io
from pathlib import Path

import pytest

from sling2sim2real.base.errors import UserError
from sling2sim2real.base.layout import Layout
from sling2sim2real.cli import remove_band as module
from sling2sim2real.cli.preflight.add_band import _with_band
from sling2sim2real.cli.remove_band import remove_band
from tests.project import BAND, DEFAULTS, contents

OTHERS = ("orange_2", "band1")


@pytest.fixture
def project(tmp_path: Path) -> Path:
    path = tmp_path / "params.yaml"
    path.write_text(DEFAULTS.read_text("utf-8"), "utf-8")
    for name in ("orange", "orange_2"):
        path.write_text(_with_band(path, name, BAND), "utf-8")
    return tmp_path


def put(root: Path, band: str) -> list[Path]:
    layout = Layout(root)
    files = [
        layout.raw(band) / "a.mcap",
        layout.episode(band) / "signals.parquet",
        layout.clamps(band),
        layout.observed(band),
        layout.theta(band, "posterior"),
        layout.policy(band, "posterior") / "policy.onnx",
        layout.trials(band, "posterior"),
        layout.evidence / f"{band}.csv",
        layout.measured / f"{band}.csv",
        layout.plans(band) / "trajectory.csv",
        layout.card(band) / "card.json",
        root / ".checkpoints" / f"{band}-episodes" / "kept",
    ]
    for file in files:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(band)
    return files


def test_all_of_a_band_goes_and_nothing_else(project: Path) -> None:
    retained = [file for band in OTHERS for file in put(project, band)]
    gone, requested = put(project, "orange"), []
    output = remove_band("orange", lambda lines: bool(requested.extend(lines) or True), project)
    assert not any(file.exists() for file in gone) and all(file.is_file() for file in retained)
    text = (project / "params.yaml").read_text("utf-8")
    assert "orange:" not in text and "  own:" in text and "  - orange_2\n" in text
    lines = output.splitlines()
    assert lines[0] == "orange removed:" and [line.strip() for line in lines[1:]] == requested
    for folder in (Layout(project).raw("orange"), Layout(project).card("orange")):
        assert str(folder) in requested  # a folder is one line
    remove_band("orange_2", lambda lines: True, project)
    assert (project / "params.yaml").read_text("utf-8") == DEFAULTS.read_text("utf-8")


@pytest.mark.parametrize(
    ("name", "answer", "message"),
    [
        ("band1", True, "band1: is a band of the virtual rig"),
        ("red", True, "band red: not in params.yaml"),
        ("orange", False, "orange: is kept; with --yes nobody is asked"),
    ],
)
def test_refused_it_removes_nothing(project: Path, name: str, answer: bool, message: str) -> None:
    put(project, "orange")
    put(project, "band1")
    before = contents(project)
    with pytest.raises(UserError, match=message):
        remove_band(name, lambda lines: answer, project)
    assert contents(project) == before


def test_killed_it_goes_on(project: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """params.yaml comes last: until then the band has its name."""
    files = put(project, "orange")

    def killed(path: Path, text: str) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(module, "write_text", killed)
        with pytest.raises(KeyboardInterrupt):
            remove_band("orange", lambda lines: True, project)
    assert "orange:" in (project / "params.yaml").read_text("utf-8")
    remove_band("orange", lambda lines: True, project)
    assert not any(file.exists() for file in files)
    assert "orange:" not in (project / "params.yaml").read_text("utf-8")


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize(("typed", "agreed"), [("y\n", True), ("Yes\n", True), ("\n", False)])
def test_it_asks_at_a_terminal_alone(monkeypatch, capsys, typed: str, agreed: bool) -> None:
    monkeypatch.setattr("sys.stdin", Terminal(typed))
    assert module.ask(["data/raw/orange"]) is agreed
    assert "  data/raw/orange\nremove all this? [y/N]" in capsys.readouterr().err
    monkeypatch.setattr("sys.stdin", io.StringIO(typed))
    assert not module.ask(["data/raw/orange"])
