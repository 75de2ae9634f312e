"""Bring a band's recordings and launches into the project, and run the stages of its card."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from pipeline.flow.dvc import repro
from pipeline.params import Params, load
from sling2sim2real.base.disk import expect_ready
from sling2sim2real.base.errors import UserError, printable
from sling2sim2real.base.files import write_text
from sling2sim2real.base.launch_table import expect_apart, file_of
from sling2sim2real.base.layout import Layout
from sling2sim2real.cli import evidence
from sling2sim2real.cli.command_line import say
from sling2sim2real.cli.params_file import edited
from sling2sim2real.cli.preflight.add_band import NAME, add_band
from sling2sim2real.cli.preflight.recordings import add_recording, digests, renew_masks
from sling2sim2real.identification.posterior.evidence import read_evidence
from sling2sim2real.recording.files import name_of as name_of_file
from sling2sim2real.recording.files import once
from stages.start import stage_of


@dataclass(frozen=True)
class NewBand:
    """What a scale, a ruler and a calliper say of a band; None: as it stands, or usual."""

    mass: float | None = None
    diameter: float | None = None
    rest_length: float | None = None

    @property
    def given(self) -> dict[str, float]:
        return {name: value for name, value in vars(self).items() if value is not None}


def fit(
    recordings: Sequence[Path],
    name: str | None,
    band: NewBand,
    launches: Path | None = None,
    root: Path | str = ".",
) -> dict:
    """Identify a band, train its policy and write its card, as far as that is not done yet.

    Args:
        recordings: MCAP files of one band; none for a band that is in params.yaml.
        name: Of the band; None: from the first file's name.
        band: With `mass` [kg] for a new one; of one that is known, it takes the place of what
            params.yaml has, and what depends on it runs again.
        launches: CSV of launches that are to be evidence.
        root: Of the project.

    Returns:
        What the card says (reports/bands/<band>/card.json), and where it lies, under `card`.

    Raises:
        UserError: Something given is wrong, and nothing is changed; or a stage fails, and what was
            done stays done.
    """
    root = Path(root)
    layout, params = Layout(root), load(root / "params.yaml")
    name = name or name_of(recordings)
    observed = [] if launches is None else evidence.read(launches)
    recordings = once(recordings)
    file_of(layout.evidence, name, [*params.bands, name])
    expect_apart(layout, name)
    evidence.joined(
        layout, name, observed, "passed over"
    )  # what is wrong is said before any change
    expect_ready(root)
    with corrected(root / "params.yaml", name, band) as params:
        if recordings:
            say(printable(f"checking {', '.join(map(str, recordings))}"))
            say(brought_in(params, layout, recordings, name, band))
            params = load(root / "params.yaml")
        card_stage = running(params, name)
    if observed:
        count = evidence.add(layout, name, observed, "passed over")
        say(f"{layout.evidence / name}.csv: {count} launches as evidence")
    read_evidence(layout.evidence, name, params)
    repro(root, card_stage, say)
    card = layout.card(name)
    return json.loads((card / "card.json").read_text("utf-8")) | {"card": str(card / "README.md")}


def name_of(recordings: Sequence[Path]) -> str:
    """A band's name from its first file's. Raises UserError where that makes none."""
    if not recordings:
        raise UserError("give a recording (FILE.mcap), or with --name a band of params.yaml")
    name = re.sub(r"[^a-z0-9]+", "_", name_of_file(recordings[0]).lower()).strip("_")
    if not NAME.fullmatch(name):
        raise UserError(
            f"{recordings[0]}: this file name makes no band name; give one: --name NAME"
        )
    return name


def brought_in(
    params: Params, layout: Layout, recordings: Sequence[Path], name: str, band: NewBand
) -> str:
    """Have the recordings in data/raw/<name> and the band in params.yaml; what was done.

    A band that is there already takes further recordings, given beside those that it has.

    Raises:
        UserError: Nothing is changed.
    """
    band_params = params.bands.get(name)
    if band_params is None:
        if band.mass is None:
            raise UserError(f"{name}: is new; weigh the band and give --mass KG, such as 0.0408")
        return add_band(name, recordings, **band.given, root=layout.root)
    if band_params.source != "recording":
        raise UserError(f"{name}: is a band of the virtual rig; choose another name: --name NAME")
    there = digests(layout.recordings(name))
    given = digests(recordings)
    new = [file for digest, file in given.items() if digest not in there]
    if there and new and there.keys() <= given.keys():
        done = add_recording(name, new, root=layout.root)
        renew_masks(recordings, there)
        return done
    if not new and name in (*params.run.bands, *params.run.own):
        renew_masks(recordings, there)
        return f"{name} is there already, with {len(there)} recordings: goes on"
    values = {what: getattr(band_params, what) for what in ("mass", "diameter", "rest_length")}
    return add_band(name, recordings, **values, root=layout.root)


@contextmanager
def corrected(path: Path, name: str, band: NewBand) -> Iterator[Params]:
    """params.yaml with the sizes of a band that it has; as it was, where what follows fails.

    Says the old and the new ones. Raises UserError where they cannot be, and changes nothing.
    """
    params = load(path)
    there = params.bands.get(name)
    new = {
        what: value for what, value in band.given.items() if there and value != getattr(there, what)
    }
    if not (there and new):
        yield params
        return
    if there.source == "rig":
        raise UserError(
            f"{name}: is a band of the virtual rig, which pulls it as bands.{name} in {path} says:"
            " choose another name (--name NAME), or edit it there"
        )
    before = path.read_text("utf-8")
    text = edited(before, lambda content: content["bands"][name].update(new))
    params = Params.parse(text, str(path))
    write_text(path, text)
    try:
        for what, value in new.items():
            say(f"{path}: bands.{name}.{what} was {getattr(there, what):g}, is {value:g} now")
        yield params
    except BaseException:
        write_text(path, before)
        say(f"{path}: is as it was")
        raise


def running(params: Params, name: str) -> str:
    """The stage of the band's card. Raises UserError where dvc.yaml has none."""
    if name not in params.bands:
        raise UserError(
            f"{name}: is no band of params.yaml, which has {', '.join(params.bands)};"
            " give its recording: sling fit FILE.mcap --mass KG"
        )
    if not (stage := stage_of(params, "card", name)):
        raise UserError(f"{name}: add it to run.own in params.yaml, which names what runs")
    if params.bands[name].source == "recording" and name in params.run.bands:
        say(
            f"{name}: stands under run.bands in params.yaml, so every method runs on it and the"
            " report shows it; under run.own instead it gets its card alone"
        )
    return stage
