"""`sling reset`: values of params.yaml as the last commit has them."""

from pathlib import Path

import pytest

from sling2sim2real.base.errors import UserError
from sling2sim2real.cli.params_file import edited
from sling2sim2real.cli.preflight.add_band import _with_band
from sling2sim2real.cli.reset import reset
from tests.project import BAND, DEFAULTS
from tools.preset import preset, write_preset
from validation.projects import ProjectCopy

TEXT = DEFAULTS.read_text("utf-8")


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """A committed params.yaml."""
    path = tmp_path / "params.yaml"
    path.write_text(TEXT, "utf-8")
    ProjectCopy(tmp_path).commit()
    return path


def change(path: Path, **values: object) -> None:
    def put(content) -> None:
        for key, value in values.items():
            section, _, name = key.partition("__")
            content[section][name] = value

    path.write_text(edited(path.read_text("utf-8"), put), "utf-8")


def test_a_key_goes_back_and_others_stay(path: Path) -> None:
    change(path, optimizer__k_nn=7)
    retained = path.read_text("utf-8")
    change(path, optimizer__k_top="many", optimizer__mutation=[0.1, 0.2])  # `many` is refused
    assert reset(["optimizer.k_top", "optimizer.mutation"], path) == [
        "optimizer.mutation was [0.1, 0.2], is [0.5, 1.0] again",
        "optimizer.k_top was many, is 5 again",
    ]
    assert path.read_text("utf-8") == retained
    assert reset(["optimizer"], path) == ["optimizer.k_nn was 7, is 15 again"]
    assert path.read_text("utf-8") == TEXT and reset(["optimizer"], path) == []


def test_without_a_key_a_preset_goes_back_and_the_labs_own_stays(path: Path) -> None:
    path.write_text(_with_band(path, "orange", BAND), "utf-8")
    mine = {"weights": {"geom": 1.0, "force": 1.0, "work": 1.0}}
    change(path, setup__max_force=25.0, methods__mine=mine)
    before = path.read_text("utf-8")
    write_preset(path, preset("paper"))
    assert path.read_text("utf-8") != before
    reset([], path)
    assert path.read_text("utf-8") == before
    assert reset(["setup.max_force"], path) == ["setup.max_force was 25.0, is 30.0 again"]


def test_what_cannot_be_is_refused_and_nothing_changes(path: Path, tmp_path_factory) -> None:
    change(path, optimizer__k_top="many", optimizer__k_nn="few")
    before = path.read_text("utf-8")
    for keys, message in (
        (["optimizer.ktop"], "optimizer.ktop: the last commit's params.yaml has no such key"),
        (["optimizer.k_top"], "optimizer.k_nn: must be"),
    ):
        with pytest.raises(UserError, match=message):
            reset(keys, path)
        assert path.read_text("utf-8") == before
    alone = tmp_path_factory.mktemp("alone") / "params.yaml"
    alone.write_text(TEXT, "utf-8")
    with pytest.raises(UserError, match="Git has no committed one"):
        reset([], alone)
    with pytest.raises(UserError, match="cannot be read"):
        reset([], alone.with_name("none.yaml"))
