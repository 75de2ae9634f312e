"""`dvc exp run -S` on a copy of the project, by DVC itself: what it leaves in params.yaml."""

import json

import pytest

from sling2sim2real.cli.params_file import edited
from sling2sim2real.cli.preflight.add_band import _with_band
from tests.project import BAND, python
from validation.projects import ProjectCopy, copy_project, run_of

pytestmark = pytest.mark.slow
RUN = ("dvc", "exp", "run")
STATUS = ("git", "status", "--porcelain", "-uall")


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> ProjectCopy:
    """A committed copy, to which a band was added since."""
    copy = ProjectCopy(tmp_path_factory.mktemp("experiments") / "copy")
    copy_project(copy.folder)
    path = copy.folder / "params.yaml"
    path.write_text(edited(path.read_text("utf-8"), few_stages), "utf-8")
    copy.commit()
    path.write_text(_with_band(path, "orange", BAND), "utf-8")
    return copy


def few_stages(content: dict) -> None:
    """One method and no ablations: DVC takes the longer, the more stages there are."""
    values = json.loads(json.dumps(run_of(["band1", "band2"], ["posterior"])))  # no list twice
    content["run"].update({key.removeprefix("run."): value for key, value in values.items()})


def params(project: ProjectCopy) -> bytes:
    return (project.folder / "params.yaml").read_bytes()


def experiments(project: ProjectCopy) -> set[str]:
    """That Git knows, but for what DVC notes of one that runs."""
    refs = project("git", "for-each-ref", "--format=%(refname)", "refs/exps").split()
    return {ref for ref in refs if not ref.startswith("refs/exps/exec/")}


def test_a_value_as_it_is_leaves_every_byte(project: ProjectCopy) -> None:
    before = params(project)
    same = ("policy.seed=1", "setup.urdf=null", "trials.targets=[1.725,1.925,2.125]")
    project(*RUN, *(word for setting in same for word in ("-S", setting)), "evidence@band1")
    assert params(project) == before
    project(*RUN, "-S", "policy.seed=2", "evidence@band1")  # what differs DVC does write there
    lines = before.splitlines(), params(project).splitlines()
    assert [(a, b) for a, b in zip(*lines, strict=True) if a != b] == [(b"  seed: 1", b"  seed: 2")]
    (project.folder / "params.yaml").write_bytes(before)


def test_a_refused_value_leaves_no_trace_of_a_run_aside(project: ProjectCopy) -> None:
    """`--temp` runs in a folder of DVC's, which goes again."""
    before, changed, refs = params(project), project(*STATUS), experiments(project)
    with pytest.raises(AssertionError, match="k_top: must be a whole number.*got 'many'"):
        project(*RUN, "--temp", "-S", "optimizer.k_top=many", "evidence@band2")
    assert params(project) == before
    assert project(*STATUS) == changed
    assert not [*(project.folder / ".dvc/tmp/exps/standalone").glob("tmp*")]
    assert experiments(project) == refs


def test_a_refused_value_in_the_folder_says_how_it_goes(project: ProjectCopy) -> None:
    before = params(project)
    with pytest.raises(
        AssertionError, match="many.*`sling reset KEY` takes it back, and"
    ) as message:
        project(*RUN, "-S", "optimizer.k_top=many", "evidence@band2")
    assert str(message.value).count("error: params.yaml: ") == 1
    assert params(project) != before
    done = python("-m", "sling2sim2real.cli.cli", "reset", "optimizer.k_top", folder=project.folder)
    assert done.stdout == "optimizer.k_top was many, is 5 again\n", done.stderr
    assert params(project) == before  # the band is there still
