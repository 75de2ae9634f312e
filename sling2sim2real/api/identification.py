"""Identify a band from its recorded pulls and, where there are any, measured launches."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from sling2sim2real.api.model import Band, Model, Theta, with_band
from sling2sim2real.base.errors import UserError
from sling2sim2real.base.files import write_json
from sling2sim2real.base.layout import Layout, NotMade
from sling2sim2real.base.machine import cores, devices, workers
from sling2sim2real.base.schema import read_json
from sling2sim2real.episode.episode import Episode
from sling2sim2real.episode.pull import launch_history
from sling2sim2real.identification.clamps import ClampCalibration, calibrate_clamps
from sling2sim2real.identification.identify import search_and_fit
from sling2sim2real.identification.objective.box import SearchBox
from sling2sim2real.identification.objective.evaluate import Evaluator
from sling2sim2real.identification.objective.loss import EpisodeLoss
from sling2sim2real.identification.posterior import identify as posterior
from sling2sim2real.identification.posterior.launches import Evidence, Observed
from sling2sim2real.identification.results.mounting import Mounting
from sling2sim2real.identification.results.theta import (
    ThetaFile,
    load_samples,
    load_theta,
    parameters_of,
)
from sling2sim2real.launching.surface.stored import Stored
from sling2sim2real.launching.trials.stretch import recorded_stretch
from sling2sim2real.quantities import QUANTITIES
from sling2sim2real.settings import Settings
from sling2sim2real.settings.identification import parameter_names
from sling2sim2real.settings.provenance import changed_since
from sling2sim2real.simulator.model import ClampedBand, LaunchHistory, LaunchSetup
from sling2sim2real.simulator.parameters import Parameters

METHOD = "posterior"


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
    intervals: dict[str, dict[str, Any]]
    samples: list[list[float]] | None
    settled: bool
    stretch: float | None
    settings: Settings


@dataclass(frozen=True)
class Identification(Model):
    """An identified band: a `Model`, and how sure it is.

    Attributes:
        intervals: By parameter; of derived values too, such as damping_product and returned_share.
        samples: θ that are compatible with the data, each as likely as the others, shape (M, P);
            columns are `theta.names`. None where the method has none.
        settled: Whether the fit has converged; if not, do not trust the intervals.
        stretch: The largest that the recordings show: length over rest length. Beyond it a launch
            is extrapolated.
        changed: Settings of params.yaml that have changed since a run identified the band, in
            words.
        policy: That the run trained; `aim` asks it. None where there is none.
    """

    intervals: dict[str, Interval] = field(default_factory=dict, repr=False)
    samples: np.ndarray | None = field(default=None, repr=False, compare=False)
    settled: bool = False
    stretch: float | None = None
    changed: tuple[str, ...] = field(default=(), repr=False)
    policy: Stored | None = field(default=None, repr=False, compare=False)

    def save(self, path: str | Path) -> None:
        """Write all of it as one JSON file, settings included."""
        samples = None if self.samples is None else self.samples.tolist()
        content = {
            **self.theta.content(self.band.name, self.history),
            "sizes": vars(self.band),
            "mounting": self.mounting and self.mounting.model_dump(),
            "intervals": {name: vars(interval) for name, interval in self.intervals.items()},
            "samples": samples,
            "settled": self.settled,
            "stretch": self.stretch,
            "settings": self.settings.model_dump(),
        }
        write_json(Path(path), content)

    @classmethod
    def load(cls, path: str | Path) -> Identification:
        """Read what `save` wrote.

        Raises:
            UserError: There is no such file, or it is damaged.
        """
        try:
            file = read_json(Path(path), _Saved)
            return cls(
                band=Band(**file.sizes),
                theta=Theta.of_file(file),
                mounting=file.mounting,
                history=file.history and LaunchHistory(**file.history.model_dump()),
                settings=file.settings,
                intervals={name: Interval(**ends) for name, ends in file.intervals.items()},
                samples=None if file.samples is None else np.array(file.samples, float),
                settled=file.settled,
                stretch=file.stretch,
            )
        except (NotMade, TypeError) as error:
            if not Path(path).is_file():
                raise
            message = getattr(error, "problem", error)
            raise UserError(
                f"{path}: was not written by Identification.save ({message})"
            ) from error

    @classmethod
    def of_run(cls, band: str, method: str = METHOD, root: str | Path = ".") -> Identification:
        """What `sling fit` or `dvc repro` found, of a project whose params.yaml is in `root`.

        Raises:
            UserError: The project has no such band or method, or has not run yet.
        """
        layout, settings = Layout(Path(root)), Settings.load(Path(root, "params.yaml"))
        if band not in settings.bands:
            raise UserError(f"{band}: params.yaml has {', '.join(settings.bands)}")
        band_params = settings.bands[band]
        content = load_theta(layout.theta(band, method), band)
        file = ThetaFile.model_validate(content)
        samples = load_samples(layout.confidence(band, method), parameters_of(content))
        path, summary = layout.clamps(band), content.get("confidence")
        policy = Stored(band, method, layout.root)
        there = layout.episode(band).is_dir()
        episodes = Episode.load_all(layout.episodes(band)) if there else []
        return cls(
            band=Band(band_params.mass, band_params.diameter, band_params.rest_length, band),
            theta=Theta.of_file(file),
            mounting=read_json(path, Mounting) if file.mounted and path.exists() else None,
            history=file.history and LaunchHistory(**file.history.model_dump()),
            settings=settings,
            intervals=_intervals(content, summary) if summary else {},
            samples=None if samples is None else samples.values,
            settled=bool(summary and summary["settled"]),
            stretch=_stretch(episodes, settings, band_params),
            changed=tuple(map(str, changed_since(settings, content, method))),
            policy=policy if policy.folder.is_dir() else None,
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
    """Identify a band as the method `posterior` of a run does; half a minute a recording.

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
    evaluate = nearest = None
    if start is None:
        mounting = None
        if settings.methods[METHOD].mounting:
            clamps = _clamps(episodes[0], band, settings)
            mounting = Mounting.model_validate(vars(clamps))
            progress(f"mounting: clamps at {clamps.clamp_angle_deg:.0f} degrees")
        sling = _sling(band, settings, mounting)
        evaluate = _evaluator(episodes[0], sling, settings)
    else:
        mounting, theta = start.mounting, start.theta
        law = settings.methods[METHOD].law
        values = {name: getattr(theta, name) or 0.0 for name in parameter_names(law)}
        nearest = Parameters.named(law, values)
        sling = _sling(band, settings, mounting)
    density = search_and_fit(
        settings,
        METHOD,
        sling,
        episodes,
        evaluate,
        start=nearest,
        evidence=Evidence(launches, LaunchSetup.of(settings.setup, settings.sling)),
        workers=workers() or cores(),
        progress=progress,
    ).density
    assert density is not None  # of a search by least squares there is one
    content = {"band": band.name, **posterior.theta_entries(density)}
    summary = posterior.confidence(density)
    file = ThetaFile.model_validate(content)
    return Identification(
        band=band,
        theta=Theta.of_file(file),
        mounting=mounting,
        history=file.history and LaunchHistory(**file.history.model_dump()),
        settings=settings,
        intervals=_intervals(content, summary),
        samples=density.parameters.values,
        settled=summary["settled"],
        stretch=_stretch(episodes, settings, band),
    )


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


def _intervals(content: dict, summary: dict) -> dict[str, Interval]:
    """Intervals by name, from a θ file's content and its confidence."""
    result = {}
    for name, parameter in summary["parameters"].items():
        value, unit = content["theta"][name], QUANTITIES[name].si
        result[name] = Interval(
            value, parameter["low"], parameter["high"], parameter["identifiable"], unit
        )
    for name, parameter in summary["derived"].items():
        value, low, high = (float(parameter[key]) for key in ("value", "low", "high"))
        result[name] = Interval(value, low, high, True, parameter["unit"])
    return result


def _stretch(episodes: Sequence[Episode], settings: Settings, band) -> float | None:
    sizes = settings.setup.fork_width, band.rest_length
    return recorded_stretch(episodes, *sizes) if episodes else None
