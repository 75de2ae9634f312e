"""What a robot must hear before it carries out a draw: what the numbers do not rest on."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from pipeline.params import Params
from sling2sim2real.base.layout import Layout, NotMade, owner
from sling2sim2real.card.verdict import FEW_SAMPLES
from sling2sim2real.cli import arguments
from sling2sim2real.episode.episode import Episode
from sling2sim2real.launching.surface.stored import Stored
from sling2sim2real.launching.trials.stretch import recorded_stretch, stretch_of
from sling2sim2real.settings.provenance import Change, changed_since, changes, policy_settings_of
from stages.start import stage_of, unmounted

MISS = 0.05  # m from the target, in simulation, from which no pose is given
ROUNDING = 1e-3  # of a stretch
MOST_SHOWN = 3  # changed keys at most

About = Literal[
    "box", "stretch", "force", "confidence", "params", "mounting", "target", "miss", "failure",
    "interval", "pose",
]  # fmt: skip


@dataclass(frozen=True)
class Hazard:
    """A reason not to trust an answer: `about` is for programs, `what` for people."""

    about: About
    what: str


def tell(hazards: Iterable[Hazard]) -> None:
    """Print hazards on stderr, a line each."""
    for hazard in hazards:
        print(f"warning: {hazard.what}", file=sys.stderr)


def as_json(hazards: Iterable[Hazard]) -> list[dict[str, str]]:
    return [asdict(hazard) for hazard in hazards]


def shown(answer: Mapping[str, Any], to_json: bool) -> str:
    """An answer with its `warnings`, which are printed first: as one JSON object, or as lines."""
    hazards = answer["warnings"]
    tell(hazards)
    if to_json:
        return arguments.shown({**answer, "warnings": as_json(hazards)}, True)
    return arguments.shown({k: v for k, v in answer.items() if k != "warnings"}, False)


def of_draw(params: Params, band: str, draw: tuple[float, float], root: Path) -> Iterator[Hazard]:
    """A draw (y, z) [m] outside the box, or further than the band was drawn in its recordings."""
    for axis, value in zip("yz", draw, strict=True):
        low, high = getattr(params.setup, f"draw_{axis}")
        if not low - 1e-6 <= value <= high + 1e-6:
            yield Hazard(
                "box",
                f"the draw's {axis} = {value:g} m lies outside setup.draw_{axis}"
                f" [{low:g}, {high:g}], where the arm reaches",
            )
    folder = Layout(root).episodes(band)
    try:
        episodes = Episode.load_all(folder)
    except NotMade:
        yield Hazard("stretch", f"{folder} is missing, so nothing tells how far the band was drawn")
        return
    sizes = params.setup.fork_width, params.bands[band].rest_length
    requested = float(stretch_of(np.array([[0.0, *draw]]), *sizes)[0])
    recorded = recorded_stretch(episodes, *sizes)
    if requested > recorded + ROUNDING:
        yield Hazard(
            "stretch",
            f"the draw stretches the band by {100 * (requested - 1):.1f} %, its recordings by"
            f" {100 * (recorded - 1):.1f} % at most: force and landing are extrapolated",
        )


def of_launch(params: Params, force: float, failure: str | None) -> Iterator[Hazard]:
    """A simulated launch that fails, or whose draw takes more force [N] than the arm may hold."""
    if failure:
        yield Hazard("failure", f"the launch fails in simulation: {failure}")
    elif force > params.setup.max_force:
        yield Hazard(
            "force",
            f"holding this draw takes {force:.1f} N, more than setup.max_force"
            f" {params.setup.max_force:g} N",
        )


def of_confidence(content: dict, path: Path) -> Iterator[Hazard]:
    """A θ file (its content) that is not sure of itself."""
    confidence = content.get("confidence")
    if not confidence:
        what = f"{path} does not tell how well its parameters are known: intervals leave that out"
        yield Hazard("confidence", what)
    elif not confidence.get("settled", True):
        yield Hazard(
            "confidence",
            f"the fit of {path} had not settled after {confidence.get('steps', 'all its')} steps:"
            " its values and intervals may be wrong",
        )
    elif (effective := confidence.get("effective_samples", np.inf)) < FEW_SAMPLES:
        what = f"the intervals of {path} rest on {effective:.0f} samples of even weight, too few"
        yield Hazard("confidence", what)


def of_identification(params: Params, content: dict, path: Path) -> Iterator[Hazard]:
    """A θ file of a run whose settings have changed since; a hand-written one has no run."""
    owner_of_file = owner(path)
    if owner_of_file and (method := owner_of_file[2]):
        mended = _mended(stage_of(params, "theta", content["band"], method))
        if "made_with" not in content or method not in params.methods:
            what = f"nothing tells with which params.yaml θ was identified: {mended}"
            yield Hazard("params", what)
        yield from _of_changes(changed_since(params, content, method), "θ was identified", mended)


def of_policy(
    params: Params, band: str, method: str, content: dict, root: Path
) -> Iterator[Hazard]:
    """A policy whose settings, or θ, are no longer those that it was trained with."""
    mended = _mended(stage_of(params, "policy", band, method))
    try:
        card = Stored(band, method, root).card()
    except NotMade as error:
        yield Hazard("params", f"{error}, so nothing tells what the policy was trained with")
        card = {"theta": content["theta"], "made_with": {}}
    else:
        if card["made_with"] is None:
            yield Hazard("params", f"nothing tells what the policy was trained with: {mended}")
    by_key = {change.key: change for change in changed_since(params, content, method)}
    if then := card["made_with"]:
        now = policy_settings_of(params, band)
        by_key |= {change.key: change for change in changes(then, now)}
    yield from _of_changes(
        [by_key[key] for key in sorted(by_key)], "the policy was trained", mended
    )
    if card.get("theta") != content["theta"]:
        what = f"the policy was trained with another θ than there is now: {mended}"
        yield Hazard("params", what)


def of_mounting(params: Params, band: str, root: Path) -> list[Hazard]:
    return [Hazard("mounting", what) for what in unmounted(params, band, root)]


def _of_changes(changes: list[Change], done: str, mended: str) -> Iterator[Hazard]:
    for change in changes[:MOST_SHOWN]:
        yield Hazard("params", f"params.yaml: {change}, since {done}: {mended}")
    if len(changes) > MOST_SHOWN:
        names = ", ".join(change.key for change in changes[MOST_SHOWN:])
        yield Hazard("params", f"params.yaml has changed since {done} also in {names}")


def _mended(stage: str | None) -> str:
    if stage is None:
        return "`run:` in params.yaml has to name band and method, then `dvc repro` mends it"
    return f"`dvc repro {stage}` mends it"
