"""A recording of a run as a lab's band is kept: reports/bands/<recording>/, for `sling aim`.

In the layout of sling2sim2real/api/band_folder.py: band.yaml, theta.json, policy.onnx, policy.json
and card/, by the method of the cards. Its recordings and episodes stay under data/.
"""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pandas as pd

from pipeline.layout import Layout
from pipeline.params.run import Pair
from sling2sim2real.api.band_folder import SIZES, BandFile, BandFolder, differences
from sling2sim2real.api.identification import Identification, fork_of
from sling2sim2real.api.model import Band, Theta, with_band
from sling2sim2real.base.files import made, replacing_folder
from sling2sim2real.base.schema import read_json
from sling2sim2real.card.camera import Pictures
from sling2sim2real.card.inputs import CardInputs, aims_of
from sling2sim2real.card.write import write as write_card
from sling2sim2real.episode.episode import Episode
from sling2sim2real.identification.results.theta import (
    Mounting,
    ThetaFile,
    load_samples,
    load_theta,
    parameters_of,
)
from sling2sim2real.launching.surface.stored import Stored
from sling2sim2real.launching.trials.stretch import recorded_stretch
from sling2sim2real.settings import Settings
from sling2sim2real.simulator.model import LaunchHistory

KEPT = (  # settings that who uses the folder needs: what the stage `card` depends on
    "force",
    "launch",
    "parameters",
    "plan.frame",
    "policy.targets",
    "setup",
    "sling",
    "trials",
)


def kept(settings: Settings, method: str) -> dict[str, dict]:
    """Of these, and of the method, what differs from the library's defaults."""
    other, found = differences(settings, Settings.default()), {}
    for place in (*KEPT, f"methods.{method}"):
        section, _, key = place.partition(".")
        values = other.get(section, {})
        if values := {name: values[name] for name in values if key in ("", name)}:
            found[section] = values
    return found


def identified(pair: Pair, root: str | Path = ".") -> Identification:
    """What the method of a pair found of a band, by one of its recordings, whose name it bears.

    Raises:
        UserError: The run has not come so far.
    """
    layout, settings = Layout(Path(root)), Settings.load(Path(root, "params.yaml"))
    sizes = settings.bands[pair.band]
    name = BandFolder(layout.card(pair)).name
    band = Band(sizes.mass, sizes.diameter, sizes.rest_length, name, sizes.preconditioned)
    content = load_theta(layout.theta(pair), pair.band)
    file = ThetaFile.model_validate(content)
    samples = load_samples(layout.confidence(pair), parameters_of(content))
    episodes, path = Episode.load_all(layout.episodes(pair)), layout.clamps(pair)
    return Identification(
        band=band,
        theta=Theta.of_file(file),
        mounting=read_json(path, Mounting) if file.mounted and path.exists() else None,
        history=file.history and LaunchHistory(**file.history.model_dump()),
        settings=with_band(settings, band),
        confidence=content.get("confidence") or {},
        samples=None if samples is None else samples.values,
        stretch=recorded_stretch(episodes, settings.setup.fork_width, sizes.rest_length),
        fork=fork_of(episodes[0]),
    )


def card_inputs(pair: Pair, root: str | Path = ".") -> CardInputs:
    """What the card of a recording is made from. Raises UserError where an input is missing."""
    layout, found = Layout(Path(root)), identified(pair, root)
    stored = Stored(layout.policy(pair))
    targets = np.array(found.settings.trials.targets, float)
    return CardInputs(
        found=found,
        method=pair.method,
        episodes=Episode.load_all(layout.episodes(pair)),
        launched=_landed(pd.read_parquet(made(layout.trials(pair)))),
        aims=aims_of(found, targets, stored.draws(targets)),
        trained=stored.card()["training"]["converged"],
        virtual=found.settings.bands[pair.band].source == "rig",
    )


def write(pair: Pair, root: str | Path = ".") -> dict:
    """Write a recording's folder; return what its card.json says. Raises UserError."""
    layout, inputs = Layout(Path(root)), card_inputs(pair, root)
    found, episode = inputs.found, inputs.episode
    recording = layout.raw(pair) / episode.metadata["input"]["file"]
    pictures = Pictures.of(recording, episode, found.settings.setup)
    with replacing_folder(layout.card(pair)) as temporary:
        folder = BandFolder(temporary)
        stored, policy = Stored(layout.policy(pair)), Stored.of_band(temporary)
        sizes = {name: getattr(found.band, name) for name in (*SIZES, "preconditioned")}
        BandFile(**sizes, settings=kept(found.settings, pair.method)).save(folder.band_file)
        found.save(folder.theta)
        shutil.copyfile(stored.network, policy.network)
        shutil.copyfile(stored.card_file, policy.card_file)
        return write_card(folder.card, inputs, pictures)


def _landed(trials: pd.DataFrame) -> pd.DataFrame:
    """Launches that landed somewhere, measured or virtual, beside what was predicted."""
    return trials.loc[trials.landing_y.notna() & trials.predicted_y.notna()]
