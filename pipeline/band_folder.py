"""A band of a run as a lab's band is kept: reports/bands/<band>/, for `sling aim` and its like.

In the layout of sling2sim2real/api/band_folder.py: band.yaml, theta.json, policy.onnx, policy.json
and card/, by the method of the cards. Its recordings and episodes stay under data/.
"""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pandas as pd

from sling2sim2real.api.band_folder import SIZES, BandFile, BandFolder, differences
from sling2sim2real.api.identification import Identification, fork_of
from sling2sim2real.api.model import Band, Theta
from sling2sim2real.api.settings import Settings
from sling2sim2real.base.files import replacing_folder
from sling2sim2real.base.layout import Layout, made
from sling2sim2real.base.schema import read_json
from sling2sim2real.card.camera import Pictures
from sling2sim2real.card.inputs import CardInputs, aims_of
from sling2sim2real.card.write import write as write_card
from sling2sim2real.episode.episode import Episode
from sling2sim2real.identification.results.mounting import Mounting
from sling2sim2real.identification.results.theta import (
    ThetaFile,
    load_samples,
    load_theta,
    parameters_of,
)
from sling2sim2real.launching.surface.stored import BandPolicy, Stored
from sling2sim2real.launching.trials.stretch import recorded_stretch
from sling2sim2real.simulator.model import LaunchHistory


def identified(band: str, method: str, root: str | Path = ".") -> Identification:
    """What a method of a run found of a band.

    Raises:
        UserError: The run has no such band or method, or has not come so far.
    """
    layout, settings = Layout(Path(root)), Settings.load(Path(root, "params.yaml"))
    sizes = settings.bands[band]
    content = load_theta(layout.theta(band, method), band)
    file = ThetaFile.model_validate(content)
    samples = load_samples(layout.confidence(band, method), parameters_of(content))
    episodes, path = Episode.load_all(layout.episodes(band)), layout.clamps(band)
    return Identification(
        band=Band(sizes.mass, sizes.diameter, sizes.rest_length, band, sizes.preconditioned),
        theta=Theta.of_file(file),
        mounting=read_json(path, Mounting) if file.mounted and path.exists() else None,
        history=file.history and LaunchHistory(**file.history.model_dump()),
        settings=settings,
        confidence=content.get("confidence") or {},
        samples=None if samples is None else samples.values,
        stretch=recorded_stretch(episodes, settings.setup.fork_width, sizes.rest_length),
        fork=fork_of(episodes[0]),
    )


def card_inputs(band: str, method: str, root: str | Path = ".") -> CardInputs:
    """What a band's card is made from. Raises UserError where an input is missing."""
    layout, found = Layout(Path(root)), identified(band, method, root)
    stored = Stored(band, method, layout.root)
    targets = np.array(found.settings.trials.targets, float)
    return CardInputs(
        found=found,
        method=method,
        episodes=Episode.load_all(layout.episodes(band)),
        launched=_landed(pd.read_parquet(made(layout.trials(band, method)))),
        aims=aims_of(found, targets, stored.draws(targets)),
        trained=stored.card()["training"]["converged"],
        virtual=found.settings.bands[band].source == "rig",
    )


def write(band: str, method: str, root: str | Path = ".") -> dict:
    """Write a band's folder; return what its card.json says. Raises UserError."""
    layout, inputs = Layout(Path(root)), card_inputs(band, method, root)
    found, episode = inputs.found, inputs.episode
    stored = Stored(band, method, layout.root)
    recording = layout.raw(band) / episode.metadata["input"]["file"]
    pictures = Pictures.of(recording, episode, found.settings.setup)
    with replacing_folder(layout.card(band)) as temporary:
        folder, policy = BandFolder(temporary), BandPolicy(temporary)
        sizes = {name: getattr(found.band, name) for name in SIZES}
        other = differences(found.settings, Settings.default())
        BandFile(sizes, found.band.preconditioned, (), other).save(folder.band_file)
        found.save(folder.theta)
        shutil.copyfile(stored.network, policy.network)
        shutil.copyfile(stored.card_file, policy.card_file)
        return write_card(folder.card, inputs, pictures)


def _landed(trials: pd.DataFrame) -> pd.DataFrame:
    """Launches that landed somewhere, measured or virtual, beside what was predicted."""
    return trials.loc[trials.landing_y.notna() & trials.predicted_y.notna()]
