"""Several recordings of a band, and several pulls in one: what is said, what is kept."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from pipeline.params import load
from sling2sim2real.base.errors import UserError
from sling2sim2real.base.layout import Layout
from sling2sim2real.cli.preflight.command import check
from sling2sim2real.cli.preflight.recordings import add_recording
from sling2sim2real.recording.build import build_episodes
from stages import episode
from tests.cli.preflight.test_add_band import add
from tests.project import contents
from tests.recording.parts import joined, metadata, split


@pytest.fixture(scope="module")
def three(seen, blind, tmp_path_factory) -> tuple[Path, list[float]]:
    """A file of three pulls, the second with black pictures, and when each began."""
    path = tmp_path_factory.mktemp("three") / "three.mcap"
    return path, joined(path, [seen[0], blind[0], seen[0]])


def more(project: Path, *recordings: Path, band: str = "red") -> str:
    return add_recording(band, recordings, project)


def test_check_lists_the_pulls_and_looks_at_the_first_that_can_be_used(three, seen, params):
    path, began = three
    text, status = check(path, params)
    assert status == 0 and "pull 1 of 3: can be used" in text
    content = json.loads(check(path, params, as_json=True, pull=3)[0])
    assert content["pull"] == 3
    assert [row["usable"] for row in content["pulls"]] == [True, False, True]
    for row, start in zip(content["pulls"], began, strict=True):
        assert row["release_s"] == pytest.approx(start + seen[1].release, abs=1e-3)
        assert row["grasp_s"] == pytest.approx(start + seen[1].grasp, abs=0.021)
        assert row["peak_force_n"] == pytest.approx(content["pulls"][0]["peak_force_n"], rel=0.01)
        assert f"{row['release_s']:.3f}" in text and row["verdict"].removesuffix(", but:") in text
    assert "empty mask" in content["pulls"][1]["verdict"]
    assert content["signals"]["release_s"] == content["pulls"][2]["release_s"]
    rest = [
        caution for caution in content["cautions"] if "after the pull before" in caution["what"]
    ]
    assert rest[0]["about"] == "pause"  # its bag hardly waits
    text, status = check(path, params, pull=2)
    assert status == 1 and "pull 2 of 3: cannot be used: empty mask" in text
    with pytest.raises(UserError, match="--pull 4: the last pull in .* is number 3"):
        check(path, params, pull=4)


def test_a_pull_alone_has_nothing_to_rest_from(looked, params) -> None:
    names = {caution.about for caution in looked.report.cautions}
    assert "rest" not in names and looked.report.pulls == [looked.report.row]


def test_recordings_are_added_to_a_band(project, seen, three) -> None:
    add(project, seen[0])
    before = (project / "params.yaml").read_bytes()
    message = more(project, three[0]).splitlines()
    assert message[0] == "red: added to the 1 that were there, 2 pulls"
    assert message[1].startswith("  three.mcap, pull 1: peak force")
    assert message[2].startswith("  three.mcap, pull 2: left out, cannot be used: empty mask")
    names = [path.name for path in Layout(project).recordings("red")]
    assert names == ["seen.mcap", "three.mcap"]
    assert (project / "data/raw/red/three.mcap").read_bytes() == three[0].read_bytes()
    assert (project / "params.yaml").read_bytes() == before


def test_episodes_of_a_check_are_the_stages(project, seen, monkeypatch) -> None:
    """Made once; the stage takes them, and then they are gone."""
    add(project, seen[0])
    params, layout = load(project / "params.yaml"), Layout(project)
    (path,) = layout.recordings("red")
    (made,), _ = build_episodes(path, "red", params)
    monkeypatch.chdir(project)
    monkeypatch.setattr(
        "sling2sim2real.recording.build.build_episodes", lambda *_: pytest.fail("made again")
    )
    monkeypatch.setattr(episode, "started", lambda *_: (params, "red"))
    episode.main()
    made.save(project / "made")
    assert contents(project / "made") == contents(layout.episode("red"))
    assert not (project / ".checkpoints/red-episodes").exists()


def test_a_split_bag_is_checked_and_kept_as_its_folder(project, seen, params, tmp_path) -> None:
    """By its folder or by a part; a bag of one part is kept as a file."""
    parts = split(seen[0], tmp_path / "given" / "july.1", (1.0, 2.0), "july")
    metadata(parts[0].parent, *(part.name for part in parts))
    whole = json.loads(check(seen[0], params, as_json=True)[0])
    report = json.loads(check(parts[0].parent, params, as_json=True)[0])
    assert (report["usable"], report["losses"]) == (True, [])
    assert report["signals"] == whole["signals"] and report["cloud"] == whole["cloud"]

    (parts[0].parent.parent / "july.1.masks").mkdir()
    (parts[0].parent.parent / "july.1.masks" / "17.png").write_bytes(b"mask")
    add(project, parts[0].parent)
    retained = project / "data/raw/red/july_1"
    assert Layout(project).recordings("red") == [retained]
    assert {file.name for file in retained.iterdir()} == {*(p.name for p in parts), "metadata.yaml"}
    assert (retained.with_name("july_1.masks") / "17.png").read_bytes() == b"mask"
    for again in (retained, parts[1]):
        with pytest.raises(UserError, match="is there already, as .*july_1"):
            more(project, again)
    folder = tmp_path / "one"
    folder.mkdir()
    shutil.copy(seen[0], folder / "one_0.mcap")
    more(project, folder)
    assert [file.name for file in Layout(project).recordings("red")] == ["july_1", "one.mcap"]


def test_a_band_of_several_recordings(project, seen, three) -> None:
    from sling2sim2real.cli.preflight.add_band import add_band

    rest = {"mass": 0.0408, "root": project}
    message = add_band("red", [three[0], seen[0]], **rest)
    assert message.startswith("red added, 3 pulls\n")
    assert "nothing to do" in add_band("red", [seen[0], three[0]], **rest)
    with pytest.raises(UserError, match="holds other recordings already"):
        add_band("red", [seen[0]], **rest)


def test_what_is_there_or_cannot_be_used_is_refused_and_nothing_is_copied(
    project, seen, blind, three, tmp_path_factory
) -> None:
    folder = tmp_path_factory.mktemp("given")
    again, other, torn = folder / "again.mcap", folder / "seen.mcap", folder / "torn.mcap"
    shutil.copy(seen[0], again)
    shutil.copy(three[0], other)
    torn.write_bytes(b"no recording")
    add(project, seen[0])
    written = contents(project)
    for recordings, words in (
        ([again], "again.mcap: is there already, as .*seen.mcap"),
        ([other], "seen.mcap is there already: give .* another name"),
        ([three[0], torn], "torn.mcap: .*not an MCAP"),
        ([three[0], blind[0]], "blind.mcap: .*empty mask"),
        ([three[0], three[0]], "two of the recordings have this name"),
        ([three[0], other], "are the same recording"),
        ([folder / "none.mcap"], "no such file"),
    ):
        with pytest.raises(UserError, match=words) as caught:
            more(project, *recordings)
        assert "\n" not in str(caught.value) and contents(project) == written
    with pytest.raises(UserError, match="--band"):
        more(project, three[0], band="blue")
