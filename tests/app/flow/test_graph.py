"""The graph against what DVC itself says and does."""

from pathlib import Path

import pytest

from app.flow.graph import Graph, Stage, leading_to
from pipeline.base.errors import UserError
from tests.app.flow.toy import Toy, stage
from tests.project import contents

DIAMOND = {
    "late": stage("late", "word"),
    "top": stage("top", "word", meta={"gpu": True}),
    "side": {"matrix": {"item": ["left", "right"]}, **stage("side-${item.item}", "top.out")},
    "bottom": stage("bottom", "side-left.out", "side-right.out"),
}

ORDER = ["top", "side@left", "side@right", "late", "bottom"]


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Toy:
    """All of it reproduced."""
    toy = Toy(tmp_path_factory.mktemp("graph") / "toy", DIAMOND, word="one\n")
    assert toy.dvc("repro") == set(ORDER)
    return toy


@pytest.fixture
def toy(done: Toy, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Toy:
    monkeypatch.setenv("DVC_SITE_CACHE_DIR", done.environment["DVC_SITE_CACHE_DIR"])
    return done.copy(tmp_path / "toy")


def test_stages_come_after_their_producers_the_longest_way_first(toy: Toy) -> None:
    stages = Graph(toy.folder).stages
    assert list(stages) == ORDER
    assert stages["top"] == Stage("top", "top", "", (), True, ("word", "work.py"), True)
    assert stages["side@left"] == Stage(
        "side@left", "side", "left", ("top",), False, ("work.py",), True
    )
    assert stages["bottom"].producers == ("side@left", "side@right")
    assert [node.name for node in leading_to(stages, "side@left")] == ["top", "side@left"]
    assert len(leading_to(stages, "bottom")) == 4


def test_stale_is_what_dvc_would_run(toy: Toy) -> None:
    graph = Graph(toy.folder)
    assert graph.stale() == []
    (toy.folder / "side-left.out").write_text("other\n")  # an output that someone changed
    assert graph.stale() == ["side@left", "bottom"]
    assert toy.dvc("repro") == set()  # DVC brings it back from its cache
    assert Graph(toy.folder).stale() == []
    (toy.folder / "dvc.lock").unlink()
    assert Graph(toy.folder).stale() == ORDER


def test_an_unchanged_output_leaves_its_consumers_fresh(toy: Toy) -> None:
    (toy.folder / "word").write_text("one\nmore\n")
    graph = Graph(toy.folder)
    assert len(graph.stale()) == 5
    assert toy.dvc("repro", "-s", "top") == {"top"}
    assert graph.is_fresh("side@left")  # by what lies there now
    (toy.folder / "top.out").write_text("two\n")
    assert not graph.is_fresh("side@left")


def test_meta_makes_no_stage_stale(toy: Toy) -> None:
    text = (toy.folder / "dvc.yaml").read_text()
    (toy.folder / "dvc.yaml").write_text(text.replace("gpu: true", "gpu: false"))
    graph = Graph(toy.folder)
    assert not graph.stages["top"].gpu
    assert graph.stale() == []


def test_parameters_are_read_when_asked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    toy = Toy(tmp_path / "toy", {"one": stage("one", "word", params=["size"])}, word="one\n")
    monkeypatch.setenv("DVC_SITE_CACHE_DIR", toy.environment["DVC_SITE_CACHE_DIR"])
    (toy.folder / "params.yaml").write_text("size: 1\nother: 1\n")
    toy.dvc("repro")
    graph = Graph(toy.folder)
    (toy.folder / "params.yaml").write_text("size: 1\nother: 2\n")
    assert graph.is_fresh("one")
    (toy.folder / "params.yaml").write_text("size: 2\nother: 2\n")
    assert not graph.is_fresh("one")


def test_asking_leaves_nothing_behind(toy: Toy) -> None:
    def state() -> dict[Path, bytes]:
        files = contents(toy.folder).items()
        return {file: text for file, text in files if file.name not in ("lock", "btime")}

    before = state()
    graph = Graph(toy.folder)
    graph.stale()
    assert state() == before


def test_dvcs_errors_are_one_line(toy: Toy, tmp_path: Path) -> None:
    with pytest.raises(UserError, match="^DVC: you are not inside of a DVC repository"):
        Graph(tmp_path)
    (toy.folder / "dvc.yaml").write_text("stages:\n  one: {cmd: [}\n")
    with pytest.raises(UserError, match=r"^DVC: [^\n]*dvc.yaml[^\n]*$"):
        Graph(toy.folder)
