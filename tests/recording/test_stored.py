"""What a check has made of a recording is what the stage would make, while nothing changes."""

import shutil
from pathlib import Path

import pytest

from pipeline.params import Params
from sling2sim2real.base.layout import Layout
from sling2sim2real.recording import stored
from sling2sim2real.recording.build import build_episodes
from tests.project import contents, with_


@pytest.fixture
def layout(tmp_path: Path, seen, episode, params) -> Layout:
    """Of a project that keeps the episode of a recording of band1."""
    layout = Layout(tmp_path)
    stored.keep(seen[0], [episode], params, layout)
    return layout


def never(*_):
    raise AssertionError("it was made again")


def test_what_is_kept_is_what_would_be_made(layout, seen, params, monkeypatch) -> None:
    (made,), _ = build_episodes(seen[0], "band1", params)
    made.save(layout.root / "made")
    monkeypatch.setattr("sling2sim2real.recording.build.build_episodes", never)
    (episode,), refused = stored.load_or_build(seen[0], "band1", params, layout)
    episode.save(layout.root / "found")
    assert contents(layout.root / "found") == contents(layout.root / "made") and not refused


def test_anything_changed_makes_it_again(layout, seen, params, monkeypatch) -> None:
    monkeypatch.setattr("sling2sim2real.recording.build.build_episodes", lambda *_: "made")

    def requested(path: Path = seen[0], band: str = "band1", params: Params = params):
        return stored.load_or_build(path, band, params, layout)

    assert requested() != "made"
    other = shutil.copy(seen[0], layout.root / "other.mcap")
    assert requested(path=other) == "made"  # an episode says of which file it is
    assert requested(band="band2") == "made"
    assert requested(params=with_(params, "force", cutoff=0.2)) == "made"
    assert requested(params=with_(params, "cloud", mask="folder")) == "made"
    stored.forget("band1", layout)
    assert requested() == "made"
    assert not (layout.root / ".checkpoints/band1-episodes").exists()
