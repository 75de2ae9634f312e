"""Bands of one's own, and the rig's with dips: a chain of stages each, none of them the run's."""

import networkx
import pytest

from pipeline.flow.dvc import graph_of
from pipeline.params import load
from stages.start import stage_of
from tests.project import BAND
from validation.projects import ProjectCopy, copy_project, run_of

SEARCHES = {
    "posterior": ("history", "density"),
    "paper": ("history", "clusters", "cma"),
    "real2sim2real": ("de",),
    "package_si": ("bo",),
}


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> ProjectCopy:
    copy = ProjectCopy(tmp_path_factory.mktemp("own") / "copy")
    copy_project(copy.folder)
    copy("git", "init", "-q")
    return copy


def add(project: ProjectCopy, *names: str) -> None:
    """All at once; how `sling add-band` writes one: tests/cli/preflight/test_add_band.py."""
    project.set({"run.own": [*names], **{f"bands.{name}": BAND for name in names}})
    for name in names:
        recording = project.folder / "data" / "raw" / name / f"{name}.mcap"
        recording.parent.mkdir(parents=True)
        recording.write_bytes(b"")


@pytest.mark.parametrize("first", SEARCHES)
def test_ten_bands_make_ten_chains_of_the_first_method(project, first: str) -> None:
    methods = [first, *(name for name in SEARCHES if name != first)]
    project("git", "checkout", "-q", "--orphan", first)
    project.set(run_of(["band1", "band2", "band3"], methods, ("de",)) | {"run.own": []})
    before = graph_of(project.folder)
    names = [f"{first}_{n}" for n in range(10)]
    add(project, *names)
    graph = graph_of(project.folder)
    mine = {*graph} - {*before}
    alone = ("episode", "clamps", "evidence", "card")
    steps = (*SEARCHES[first], "theta", "policy", "trials")
    assert mine == {
        *(f"own_{step}@{name}" for step in alone for name in names),
        *(f"own_{step}@{name}-{first}" for step in steps for name in names),
    }
    params = load(project.folder / "params.yaml")
    for name in names:
        card = stage_of(params, "card", name)
        chain = {card, *networkx.ancestors(graph, card)}
        assert card == f"own_card@{name}" and chain == {
            stage for stage in mine if is_of(stage, name)
        }
        for step in steps:
            assert stage_of(params, step, name, first) in chain
        assert stage_of(params, "theta", name, methods[1]) is None
    changed = {name for name in before if {*graph.pred[name]} != {*before.pred[name]}}
    assert changed == {"report"}  # it reads the folders of all bands


def is_of(stage: str, band: str) -> bool:
    return stage.partition("@")[2].partition("-")[0] == band


@pytest.mark.parametrize(("kind", "band", "count"), [("own_", "mine", 9), ("dip_", "dipped", 11)])
def test_such_a_stage_is_its_namesake_but_for_the_band(
    project: ProjectCopy, kind: str, band: str, count: int
) -> None:
    """The same command, code and parameters; of one's own nothing of the rig."""
    from dvc.repo import Repo

    project.set(run_of(["band1"], ["posterior"]) | {"run.own": []})
    if kind == "own_":
        add(project, band)
    else:
        sizes = {"mass": 0.023, "diameter": 0.010, "rest_length": 0.52}
        project.set({f"bands.{band}": {"source": "rig", **sizes}, "run.dips": [band]})
        project.set({f"rig.bands.{band}": {"like": "band1", "pull": "informative"}})
        params = load(project.folder / "params.yaml")
        assert stage_of(params, "launches", band, "posterior") == (f"dip_launches@{band}-posterior")
    with Repo(str(project.folder)) as repo:
        stages = {stage.name: stage for stage in repo.index.stages}
    names = [name for name in stages if name.startswith(kind)]
    assert len(names) == count

    def read(name: str, band: str) -> set[str]:
        return {f"{dep}".replace(band, "BAND") for dep in stages[name].deps}

    for name in names:
        rigs = name.removeprefix(kind).replace(f"@{band}", "@band1")
        assert read(name, band) == read(rigs, "band1")
        assert stages[name].cmd == stages[rigs].cmd.replace("band1", band)
