"""Identify a band from its recorded pulls and, where there are any, measured launches."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from sling2sim2real.api.identification import METHOD, Identification, fork_of
from sling2sim2real.api.model import Band, Model, Theta, with_band
from sling2sim2real.base.errors import UserError
from sling2sim2real.base.machine import cores, workers
from sling2sim2real.episode.episode import Episode
from sling2sim2real.episode.pull import launch_history
from sling2sim2real.identification.clamps import ClampCalibration, calibrate_clamps
from sling2sim2real.identification.objective.evaluate import Evaluator
from sling2sim2real.identification.posterior.confidence import confidence, theta_entries
from sling2sim2real.identification.posterior.identify import fit_posterior
from sling2sim2real.identification.posterior.launches import Evidence, Observed
from sling2sim2real.identification.results.theta import Mounting, ThetaFile
from sling2sim2real.identification.search import explore
from sling2sim2real.launching.trials.stretch import recorded_stretch
from sling2sim2real.settings import Settings
from sling2sim2real.settings.identification import parameter_names
from sling2sim2real.simulator.model import ClampedBand, LaunchHistory, LaunchSetup
from sling2sim2real.simulator.parameters import Parameters


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
    evaluate = Evaluator.of(settings, METHOD, episode, _sling(band, settings, mounting))
    explored = explore(settings, METHOD, evaluate)
    progress(f"explored {len(explored.total)} points")
    best = explored.best_parameters(settings.methods[METHOD].law)
    return Model(band, Theta.of(best.names, best.values[0], best.law), mounting, settings=settings)


def _sling(band: Band, settings: Settings, mounting: Mounting | None) -> ClampedBand:
    law = settings.methods[METHOD].law
    return ClampedBand.of(band, settings.setup, settings.sling, mounting, law=law)


def _clamps(episode: Episode, band: Band, settings: Settings) -> ClampCalibration:
    sling = ClampedBand.of(band, settings.setup, settings.sling)
    return calibrate_clamps(settings, sling, episode, workers=cores())
