"""Identify a band from its recorded pulls and, where there are any, measured launches."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from sling2sim2real.api.band_folder import BandFolder
from sling2sim2real.api.model import Band, Model, Theta, with_band
from sling2sim2real.api.settings import Settings
from sling2sim2real.base.errors import UserError
from sling2sim2real.base.files import write_json
from sling2sim2real.base.layout import NotMade
from sling2sim2real.base.machine import cores, devices, workers
from sling2sim2real.base.schema import JsonRecord, Pose, read_json
from sling2sim2real.episode.episode import Episode
from sling2sim2real.episode.pull import launch_history
from sling2sim2real.identification.clamps import ClampCalibration, calibrate_clamps
from sling2sim2real.identification.objective.box import SearchBox
from sling2sim2real.identification.objective.evaluate import Evaluator
from sling2sim2real.identification.objective.loss import EpisodeLoss
from sling2sim2real.identification.posterior.identify import (
    confidence,
    fit_posterior,
    theta_entries,
)
from sling2sim2real.identification.posterior.launches import Evidence, Observed
from sling2sim2real.identification.results.mounting import Mounting
from sling2sim2real.identification.results.theta import ThetaFile
from sling2sim2real.identification.results.units import SI_UNITS
from sling2sim2real.identification.search.explore import explore
from sling2sim2real.launching.surface.stored import BandPolicy, PolicyFiles
from sling2sim2real.launching.trials.stretch import recorded_stretch
from sling2sim2real.settings.identification import parameter_names
from sling2sim2real.simulator.model import ClampedBand, LaunchHistory, LaunchSetup
from sling2sim2real.simulator.parameters import Parameters

METHOD = "least_squares"


class Fork(JsonRecord):
    """Where the fork stands: pose of frame O in the robot's base, and the base's name, "" of none.

    The pose is x, y, z [m] and the quaternion qx, qy, qz, qw.
    """

    pose: Pose
    frame: str


@dataclass(frozen=True)
class Interval:
    """What is known of one parameter.

    Attributes:
        value: The most likely one.
        low, high: Nine of ten compatible values lie between them.
        identifiable: False where the data tell nothing: it is fixed, or the interval fills its box.
        unit: SI; "" for a plain number.
    """

    value: float
    low: float
    high: float
    identifiable: bool
    unit: str


class _Saved(ThetaFile):
    """What `Identification.save` writes."""

    sizes: dict[str, Any]
    mounting: Mounting | None
    samples: list[list[float]] | None
    stretch: float | None
    settings: Settings
    fork: Fork | None = None
    digest: str | None = None


@dataclass(frozen=True)
class Identification(Model):
    """An identified band: a `Model`, and how sure it is.

    Attributes:
        confidence: How sure, as a θ file has it; empty where the method does not tell.
        samples: θ that are compatible with the data, each as likely as the others, shape (M, P);
            columns are `theta.names`. None where the method has none.
        stretch: The largest that the recordings show: length over rest length. Beyond it a launch
            is extrapolated.
        fork: Where the fork stands in the robot's base, as the first recording has it.
        policy: Of the folder that it was loaded from; `aim` asks it. None where there is none.
        stale: Whether that folder's recordings, launches or settings have changed since.
    """

    confidence: dict[str, Any] = field(default_factory=dict, repr=False, compare=False)
    samples: np.ndarray | None = field(default=None, repr=False, compare=False)
    stretch: float | None = None
    fork: Fork | None = field(default=None, repr=False)
    policy: PolicyFiles | None = field(default=None, repr=False, compare=False)
    stale: bool = field(default=False, repr=False, compare=False)

    @cached_property
    def intervals(self) -> dict[str, Interval]:
        """Intervals by parameter; of derived values too, such as damping_product."""
        return _intervals(self.content()["theta"], self.confidence) if self.confidence else {}

    @property
    def settled(self) -> bool:
        """Whether the fit has converged; if not, do not trust the intervals."""
        return bool(self.confidence.get("settled"))

    @property
    def sampled(self) -> Parameters | None:
        """The samples as the simulator takes them."""
        return None if self.samples is None else Parameters(self.theta.law, self.samples)

    def content(self) -> dict[str, Any]:
        """What a θ file says of it."""
        return self.theta.content(self.band.name, self.history) | {
            "mounted": self.mounting is not None,
            "confidence": self.confidence or None,
        }

    def save(self, path: str | Path, digest: str | None = None) -> None:
        """Write all of it as one JSON file, settings included.

        Args:
            digest: Of all that it rests on, in a band's folder.
        """
        content = {
            **self.content(),
            "sizes": vars(self.band),
            "mounting": self.mounting and self.mounting.model_dump(),
            "samples": None if self.samples is None else self.samples.tolist(),
            "stretch": self.stretch,
            "fork": self.fork and self.fork.model_dump(),
            "settings": self.settings.model_dump(),
            "digest": digest,
        }
        write_json(Path(path), content)

    @classmethod
    def load(cls, path: str | Path) -> Identification:
        """Read what `save` wrote, or a band's folder, whose policy and staleness come with it.

        Raises:
            UserError: There is no such file or folder, or it is damaged.
        """
        path, folder = Path(path), None
        if path.is_dir():
            folder = BandFolder.at(path)
            path = folder.theta
            if not path.is_file():
                raise UserError(
                    f"{path}: {folder.name} is not identified yet: `sling fit {folder.path}`"
                )
        try:
            file = read_json(path, _Saved)
            found = cls(
                band=Band(**file.sizes),
                theta=Theta.of_file(file),
                mounting=file.mounting,
                history=file.history and LaunchHistory(**file.history.model_dump()),
                settings=file.settings,
                confidence=file.model_dump(exclude_unset=True)["confidence"] or {},
                samples=None if file.samples is None else np.array(file.samples, float),
                stretch=file.stretch,
                fork=file.fork,
            )
        except (NotMade, TypeError) as error:
            if not path.is_file():
                raise
            message = getattr(error, "problem", error)
            raise UserError(
                f"{path}: was not written by Identification.save ({message})"
            ) from error
        if folder is None:
            return found
        policy = BandPolicy(folder.path)
        return replace(
            found,
            policy=policy if policy.network.is_file() else None,
            stale=file.digest is not None and file.digest != folder.digest,
        )


def identify(
    episodes: Sequence[Episode],
    band: Band,
    *,
    launches: Sequence[Observed] = (),
    settings: Settings | None = None,
    start: Model | None = None,
    progress: Callable[[str], None] = lambda line: None,
) -> Identification:
    """Identify a band as the method `least_squares` of a run does; half a minute a recording.

    Three steps: how the band hangs, from the first episode before it is taut; the best of a design
    over the whole box of parameters; from there the mode of one density over all episodes and
    launches, with samples of it. docs/identification.md says what is fitted. SLING_WORKERS says on
    how many cores, which changes no result.

    >>> from sling2sim2real import Band, Model, Observed, Settings, Theta
    >>> from sling2sim2real import episode_from_arrays, identify, rehearse
    >>> band, settings = Band(0.023, 0.010, 0.52), Settings.coarse()
    >>> true = Theta(2.0e5, 0.47, 2.4e-3, 0.7, 0.6, mooney_share=0.1, relaxation=0.004)
    >>> world = Model(band, true, settings=settings)
    >>> episode = episode_from_arrays(**rehearse(world))
    >>> identification = identify([episode], band, settings=settings, start=world)
    >>> young = identification.intervals["youngs_modulus"]
    >>> young.low < 2.0e5 < young.high
    True

    Args:
        episodes: Of this band, at least one.
        band: What was weighed and measured.
        launches: Measured, as evidence; at a draw (y, z), its error, the landing [m].
        settings: Boxes, budget, lab; None: `Settings.default()`.
        start: A model of the band to start from: without it, the first two steps.
        progress: Called with a line at each step.

    Raises:
        UserError: No episode; a recording that no simulation can follow.
    """
    settings = with_band(settings or Settings.default(), band)
    if not episodes:
        raise UserError("identify: give at least one episode")
    for episode in episodes:
        launch_history(episode)  # refuses one without a pull
    for launch in launches:
        if launch.error is None:
            raise UserError(f"launches: {launch}: the draw's error is needed")
    start = start or starting_model(episodes[0], band, settings=settings, progress=progress)
    law = settings.methods[METHOD].law
    values = {name: getattr(start.theta, name) or 0.0 for name in parameter_names(law)}
    density = fit_posterior(
        settings,
        METHOD,
        _sling(band, settings, start.mounting),
        episodes,
        Parameters.named(law, values),
        evidence=Evidence(launches, LaunchSetup.of(settings.setup, settings.sling)),
        workers=workers() or cores(),
        progress=lambda fit: progress(f"expansion {fit.steps}: misfit {fit.misfit:.2f}"),
    )
    file = ThetaFile.model_validate({"band": band.name, **theta_entries(density)})
    return Identification(
        band=band,
        theta=Theta.of_file(file),
        mounting=start.mounting,
        history=file.history and LaunchHistory(**file.history.model_dump()),
        settings=settings,
        confidence=confidence(density),
        samples=density.parameters.values,
        stretch=recorded_stretch(episodes, settings.setup.fork_width, band.rest_length),
        fork=fork_of(episodes[0]),
    )


def starting_model(
    episode: Episode,
    band: Band,
    *,
    settings: Settings | None = None,
    progress: Callable[[str], None] = lambda line: None,
) -> Model:
    """Where `identify` starts: how the band hangs, and the best of a design over the whole box.

    Args:
        episode: The first of the band.
        band, settings, progress: As `identify` takes them.

    Raises:
        UserError: No simulation can follow the recording.
    """
    settings = with_band(settings or Settings.default(), band)
    mounting = None
    if settings.methods[METHOD].mounting:
        clamps = _clamps(episode, band, settings)
        mounting = Mounting.model_validate(vars(clamps))
        progress(f"mounting: clamps at {clamps.clamp_angle_deg:.0f} degrees")
    evaluate = _evaluator(episode, _sling(band, settings, mounting), settings)
    explored = explore(settings, METHOD, evaluate)
    progress(f"explored {len(explored.total)} points")
    best = explored.best_parameters(settings.methods[METHOD].law)
    return Model(band, Theta.of(best.names, best.values[0]), mounting, settings=settings)


def fork_of(episode: Episode) -> Fork | None:
    """Where its recording has the fork; None of an episode that was made of arrays."""
    geometry = episode.metadata.get("geometry")
    return geometry and Fork(pose=geometry["base_to_fork"], frame=geometry["base_frame"])


def _sling(band: Band, settings: Settings, mounting: Mounting | None) -> ClampedBand:
    law = settings.methods[METHOD].law
    return ClampedBand.of(band, settings.setup, settings.sling, mounting, law=law)


def _clamps(episode: Episode, band: Band, settings: Settings) -> ClampCalibration:
    sling = ClampedBand.of(band, settings.setup, settings.sling)
    return calibrate_clamps(settings, sling, episode, workers=cores())


def _evaluator(episode: Episode, sling: ClampedBand, settings: Settings) -> Evaluator:
    box = SearchBox.of_method(settings, METHOD)
    loss = EpisodeLoss.of(settings, METHOD, episode, sling)
    return Evaluator(episode, sling, loss, box, devices=devices(), workers=workers())


def _intervals(theta: dict, confidence: dict) -> dict[str, Interval]:
    """Intervals by name, of a θ file's content."""
    result = {}
    for name, parameter in confidence["parameters"].items():
        ends = parameter["low"], parameter["high"], parameter["identifiable"]
        result[name] = Interval(theta[name], *ends, SI_UNITS.get(name, ""))
    for name, parameter in confidence["derived"].items():
        value, low, high = (float(parameter[key]) for key in ("value", "low", "high"))
        result[name] = Interval(value, low, high, True, parameter["unit"])
    return result
