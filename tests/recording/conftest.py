from __future__ import annotations

import shutil
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from pipeline.params import Params, load
from sling2sim2real.episode.episode import Episode
from sling2sim2real.recording import checks
from sling2sim2real.recording.build import Processed, Whole, episode_of, process_recording
from sling2sim2real.recording.checks import Finding
from sling2sim2real.recording.events import Part, Pull
from sling2sim2real.recording.frames import geometry_of
from sling2sim2real.recording.mask import RidgeMask
from sling2sim2real.recording.signals import signals_of
from sling2sim2real.recording.streams import Recording, read_recording
from tests import once
from tests.project import DEFAULTS, with_
from validation.recordings.bag import Truth, write_bag


@pytest.fixture(scope="session")
def params() -> Params:
    """The project's parameters with a window that suits the small recordings."""
    whole = with_(load(DEFAULTS), "bands.band1", diameter=0.010)  # as the small bags have it
    return with_(whole, "episode", duration=3.6, samples=120, tail=0.5)


@pytest.fixture(scope="session")
def seen(tmp_path_factory):
    """(path, truth) of a recording with pictures."""
    return written(tmp_path_factory, "seen.mcap")


def processed_of(path: Path, params: Params) -> Processed:
    """The first pull of a recording that can be used. Raises UserError."""
    return process_recording(path, params.bands["band1"], params)[0][0]


def whole_of(path: Path, params: Params) -> Whole:
    """All of it. Raises UserError."""
    whole = processed_of(path, params).whole
    assert whole
    return whole


def part_of(recording: Recording, params: Params) -> Part:
    """All of it as one pull."""
    return Part(recording, geometry_of(recording, params.setup))


def pull_of(recording: Path | Recording, params: Params) -> Pull:
    """With its events. Raises UserError."""
    if isinstance(recording, Path):
        recording = read_recording(recording, params.setup)
    return Pull.of(part_of(recording, params))


@pytest.fixture(scope="session")
def processed(seen, params) -> Processed:
    """`seen`, worked out once; to be read only."""
    return processed_of(seen[0], params)


@pytest.fixture(scope="session")
def checked(processed) -> Whole:
    """All of it; to be read only."""
    return processed.whole


@pytest.fixture(scope="session")
def episode(processed) -> Episode:
    """Of `seen`; to be read only."""
    return episode_of(processed, "band1")


@pytest.fixture(scope="session")
def masked(seen, params, tmp_path_factory) -> Path:
    """`seen`, with the masks that RidgeMask made of it beside it; to be read only."""

    def make(folder: Path) -> None:
        shutil.copy(seen[0], folder / "masked.mcap")
        (folder / "masked.masks").mkdir()
        view = whole_of(seen[0], params).view
        ridge = RidgeMask(view)
        for number, frame in view.frames():
            whole = np.zeros(view.depth(number).shape, np.uint8)
            whole[view.window] = 255 * ridge.mask(frame)
            Image.fromarray(whole).save(folder / "masked.masks" / f"{view.stamp(number)}.png")

    return once.folder(tmp_path_factory, "masked", make) / "masked.mcap"


@pytest.fixture(scope="session")
def blind(tmp_path_factory):
    """(path, truth) of a recording with black pictures, for what needs no band in them."""
    return written(tmp_path_factory, "blind.mcap", cameras=False, rate=500)


def written(factory: pytest.TempPathFactory, name: str, **options) -> tuple[Path, Truth]:
    """A recording for all tests of the run."""

    def make(folder: Path) -> tuple[Path, Truth]:
        return folder / name, write_bag(folder / name, **options)

    return once.value(factory, name, make)


@pytest.fixture(scope="session")
def whole(blind) -> Path:
    return blind[0]


# Sound recordings, changed in one thing, and what the checks find in them.

BAND = "band1"


def with_recording(done: Whole, **changes) -> Part:
    """With other streams or words."""
    pull = done.pull
    return Part(replace(pull.recording, **changes), pull.geometry, pull.number, pull.count)


def with_facts(done: Whole, **facts) -> Whole:
    """With other `SignalFacts`."""
    signals = replace(done.signals, facts=replace(done.signals.facts, **facts))
    return replace(done, signals=signals)


def with_force(done: Whole, change, params: Params) -> Whole:
    """With `change(times, values)` of the raw force, from the events on. Raises UserError."""
    wrench = done.pull.recording.wrench
    values = change(done.pull.force_time, wrench.values)
    pull = Pull.of(with_recording(done, wrench=replace(wrench, values=values)))
    signals = signals_of(pull, params, done.delays.tool_inertia)
    return replace(done, pull=pull, signals=signals, scene=replace(done.scene, signals=signals))


def of_signals(done: Whole, params: Params) -> list[Finding]:
    band = params.bands[BAND]
    scene = replace(done.scene, signals=done.signals)
    return [
        *checks.of_signals(done.pull, done.delays, done.signals, scene, band, params, weighed=True)
    ]


def of_pictures(done: Whole, taut: float | None = 1.0) -> list[Finding]:
    return [*checks.of_pictures(done.scene, done.clouds, done.coverage, (taut, 0.0))]


def abouts(findings: Iterable[Finding]) -> set[str]:
    return {finding.about for finding in findings}
