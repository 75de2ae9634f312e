"""The evidence of one recording: residuals over their spread, and its own nuisances, eliminated.

    -2 log p(recording | phi) = min over n of |r(phi, n) / sigma|^2 + |n / tolerance|^2

Nuisances n are what a recording leaves open of its instruments, Gaussian, each recording's own.
Release and the hand's offset along the pull are simulated, and what another camera's clock sees is
taken from the same rollouts; bias, drift and gain of the force, its clock against the pose's, the
extrinsics and the stamp of each picture act linearly on the measured side. For Gaussians the
minimum over n is, up to a constant, the integral over n.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from copy import copy
from dataclasses import dataclass, replace

import numpy as np

from sling2sim2real.episode.episode import Episode
from sling2sim2real.identification.posterior.alignment import recoil_seen
from sling2sim2real.identification.posterior.coordinates import LOSS
from sling2sim2real.identification.posterior.expansion import Expansion, Form
from sling2sim2real.identification.posterior.residuals import Residuals, Rule
from sling2sim2real.simulator.interaction import Rollouts, interact, with_recorded_pads
from sling2sim2real.simulator.model import ClampedBand
from sling2sim2real.simulator.parameters import Parameters

SIMULATED = "release", "camera", "hand"
RELEASE_ERROR_S = 3e-5  # s: of the release, where the clocks are known by it
NUISANCE_STEPS = np.array([1e-4, 2e-4, 5e-4])  # of finite differences [s, s, m]


@dataclass(frozen=True)
class Tolerances:
    """Standard deviations of the residuals and of what the recording leaves open.

    Attributes:
        force: Of a sample of the force [N]. Its low-pass repeats a sample's error in some 14, and
            so does what the law gets wrong of the pull: 30 mN each are worth 30 sqrt(14) alone.
        cloud, recoil: Of a bin of a picture [m], and of the recoil as a share of how far the middle
            has travelled.
        release, camera: Of the release and of the camera's clock against the force's [s]. A camera
            whose clock is known by the release has all of it.
        hand: Of the hand's place along the pull [m].
        jitter: Of one picture's stamp [s].
        shift, turn: Of the camera's extrinsics [m], [rad].
        bias, drift: Of the tared force, and over the pull [N].
        gain: Of the force sensor: datasheets have 1 to 1.5 % of full scale in 95 of 100 cases.
        pose: Of the pose's clock against the force's [s].
    """

    force: float = 0.11
    cloud: float = 1.0e-3
    recoil: float = 0.02
    release: float = 3e-4
    camera: float = 1e-3
    hand: float = 1e-5
    jitter: float = 3e-4
    shift: float = 2e-3
    turn: float = 3e-3
    bias: float = 0.02
    drift: float = 0.02
    gain: float = 6e-3
    pose: float = 5e-4

    @classmethod
    def of(cls, episode: Episode) -> Tolerances:
        """Read the tolerances from an episode's metadata; the usual ones where it says nothing."""
        preprocessing = episode.metadata.get("preprocessing", {})
        delays = preprocessing.get("delays") or {}
        clocks = {name: delays.get(name) or {} for name in ("camera", "pose")}
        given = {name: clock.get("left") or clock.get("error") for name, clock in clocks.items()}
        given["release"] = preprocessing.get("release_error")
        if given["camera"] and clocks["camera"].get("against", "pose") == "pose":
            given["camera"] = np.hypot(given["camera"], given["pose"] or 0.0)
            if clocks["pose"].get("against") == "release":  # and so is the camera's, by the pose
                given["pose"] = np.hypot(given["pose"] or 0.0, given["release"] or 0.0)
                given["release"] = RELEASE_ERROR_S
        return cls(**{name: float(value) for name, value in given.items() if value})

    @property
    def simulated(self) -> np.ndarray:
        return np.array([self.release, self.camera, self.hand])


def _picture_count(episode: Episode) -> int:
    """How many of the first pictures hold all that count."""
    return max(Rule().pictures(episode), default=-1) + 1


class Failed(Exception):
    """A simulation did not reach its end."""


class Likelihood:
    """Likelihood of the parameters of a band, by one recording.

    Attributes:
        episode, cutoff: As given.
        sling: As given, with the pads' opening time of this episode.
        tolerances: By the episode's metadata, until `with_wider_tolerances`.
        alike: How many recordings show a recoil. What the law gets wrong of it is in all of them,
            so that together they may not tell more of it than one: each counts as one of so many.
        camera_shift: What was added to the camera's stamps before the fit [s].
    """

    def __init__(
        self, episode: Episode, sling: ClampedBand, cutoff: float, friction: float
    ) -> None:
        """`friction` is what the method fixes, of the pads."""
        self.episode, self.cutoff = episode, cutoff
        self.sling = with_recorded_pads(sling, episode, friction)
        self.tolerances, self.camera_shift, self.alike = Tolerances.of(episode), 0.0, 1
        end = np.searchsorted(episode.time, episode.release_time)
        place = episode.position[max(end - 5, 0) : end].mean(axis=0)
        self._along_pull = place / np.linalg.norm(place)
        self._picture_count = _picture_count(episode)

    def aligned(self, parameters: Parameters) -> Likelihood:
        """Set the camera's clock, in a copy, to where these parameters show the recoil best.

        `parameters` are one sample. Where no other clock shows it clearly better, the likelihood
        itself is returned. A fit that starts a picture away can end in another minimum: a picture
        from before the release does not change with the camera's clock. Raises Failed.
        """
        best = recoil_seen(self.episode, self.tolerances.camera, parameters, self.sling)
        if best is None:
            return self
        aligned = copy(self)
        aligned.camera_shift = best
        aligned.episode = replace(self.episode, cloud_time=self.episode.cloud_time + best)
        aligned._picture_count = _picture_count(aligned.episode)
        return aligned

    @property
    def shows_recoil(self) -> bool:
        """Whether any picture of the recoil counts."""
        pictures = Rule().pictures(self.episode)
        return bool((self.episode.cloud_time[pictures] > self.episode.release_time).any())

    def among(self, alike: int) -> Likelihood:
        """Copy that is one of so many that show a recoil."""
        one = copy(self)
        one.alike = alike
        return one

    def with_wider_tolerances(self, expansion: Expansion) -> Likelihood:
        """Copy with force and recoil as sure as the law can follow them.

        Their tolerances are what a fit left of them, where that is more.
        """
        wider = copy(self)
        force = max(self.tolerances.force, expansion.discrepancy)
        recoil = max(self.tolerances.recoil, expansion.recoil_discrepancy)
        wider.tolerances = replace(self.tolerances, force=force, recoil=recoil)
        return wider

    def shifted(self, nuisances: np.ndarray) -> Episode:
        """The episode with another release, camera's clock and place of the hand, (3,).

        Without the pictures that count nowhere.
        """
        release, camera, hand = nuisances
        return replace(
            self.episode,
            release_time=self.episode.release_time + release,
            cloud_time=self.episode.cloud_time[: self._picture_count] + camera,
            position=self.episode.position + hand * self._along_pull,
        )

    def simulate(
        self, parameters: Parameters, nuisances: np.ndarray, delays: Sequence[float] = (0.0,)
    ) -> list[Rollouts]:
        """Rollouts of N parameters, as pictures show them that are delayed [s]. Raises Failed.

        They end with the last picture that counts.
        """
        episode = self.shifted(nuisances)
        stamps = [episode.cloud_time + delay for delay in delays]
        every, places = np.unique(np.concatenate(stamps), return_inverse=True)
        seen = replace(episode, cloud_time=every)
        rollouts = interact(self.sling, seen, parameters, until=max(every, default=np.inf))
        if why := next((reason for reason in rollouts.failure if reason), None):
            raise Failed(why)
        return [
            replace(rollouts, cloud_time=times, center_line=rollouts.center_line[:, where])
            for times, where in zip(stamps, np.split(places, len(stamps)), strict=True)
        ]

    def expand(
        self,
        parameters_of: Callable[[np.ndarray], Parameters],
        phi: np.ndarray,
        steps: np.ndarray,
        nuisances: np.ndarray,
        pool: Executor,
        form: Form | None = None,
    ) -> Expansion:
        """Expand around coordinates (D,) with finite differences `steps` (D,). Raises Failed.

        Args:
            parameters_of: Of coordinates (N, D), as `Coordinates.parameters`.
            nuisances: The simulated ones, shape (3,).
            pool: Maps over batches of rollouts.
            form: None: that of the rollout there.
        """
        around = parameters_of(phi + np.vstack([0 * steps, np.diag(steps)]))
        release, _, hand = np.diag(NUISANCE_STEPS)
        jobs = [
            (around, nuisances, (0.0, NUISANCE_STEPS[1])),
            (around[:1], nuisances + release),
            (around[:1], nuisances + hand),
        ]
        (first, later), (released,), (led,) = pool.map(lambda job: self.simulate(*job), jobs)
        later = replace(later, force=later.force[:1], center_line=later.center_line[:1])
        residuals = form.residuals if form else self._binned(first)
        here, *others = residuals(first)
        moved = np.concatenate([residuals(rollouts) for rollouts in (released, later, led)])
        slopes = (np.array(others) - here) / steps[:, None]
        nuisance_slopes = (moved - here) / NUISANCE_STEPS[:, None]
        form = form or self._form(residuals, here, nuisance_slopes[SIMULATED.index("camera")])
        # The force tells nothing of the loss factor, the recoil does: a law that lacks slow
        # hysteresis would take the one for the other.
        uncounted = slopes[LOSS].copy()
        uncounted[3 * len(residuals.samples) :] = 0.0
        slopes[LOSS] -= uncounted
        parts = here, slopes, nuisance_slopes, uncounted
        prior = self._priors(nuisances), 1 / self.tolerances.simulated
        return Expansion.of(form, *parts, *prior, origin=float(phi[LOSS]))

    def remaining(
        self,
        parameters: Parameters,
        expansion: Expansion,
        nuisances: np.ndarray,
        loss: np.ndarray,
        workers: int,
    ) -> np.ndarray:
        """What nuisances leave of the residuals of N parameters, NaN where a simulation fails.

        Its squares add up to -2 log p, in the form of an expansion and with the nuisances' effects
        there.

        Args:
            nuisances: Where the expansion was made, shape (3,).
            loss: The logarithm of the loss factor, shape (N,).

        Returns:
            Shape (N, Q).
        """
        seen = self.shifted(nuisances)
        until = max(seen.cloud_time, default=np.inf)
        rollouts = interact(self.sling, seen, parameters, until=until, workers=workers)
        residuals = expansion.form.whitened(expansion.form.residuals(rollouts))
        priors = np.tile(self._priors(nuisances), (len(residuals), 1))
        moved = np.outer(loss - expansion.origin, expansion.uncounted)
        remaining = expansion.cleared(np.hstack([residuals, priors]) - moved)
        remaining[[why is not None for why in rollouts.failure]] = np.nan
        return remaining

    def _priors(self, nuisances: np.ndarray) -> np.ndarray:
        """Residuals of the simulated nuisances' own priors, shape (3,).

        Of the camera's clock `camera_shift` was taken beforehand, and belongs to what its prior
        judges.
        """
        shift = self.camera_shift * (np.array(SIMULATED) == "camera")
        return (nuisances + shift) / self.tolerances.simulated

    def _binned(self, rollouts: Rollouts) -> Residuals:
        return Residuals(self.episode, self.sling, self.cutoff, rollouts.center_line[0])

    def _form(self, residuals: Residuals, here: np.ndarray, camera: np.ndarray) -> Form:
        """The density's form by residuals (R,) and how the camera's clock changes them, (R,)."""
        has, changes = self.tolerances, residuals.columns(here)
        sizes = {"force_bias": has.bias, "force_drift": has.drift}
        sizes |= {"force_gain": has.gain, "force_delay": has.pose}
        sizes |= {"cloud_shift": has.shift, "cloud_turn": has.turn}
        columns = [sizes[re.sub("_[xyz]$", "", name)] * change for name, change in changes.items()]
        for picture in np.unique(residuals.picture[residuals.recoils]):
            columns.append(has.jitter * np.where(residuals.of_picture(picture), camera, 0.0))
        weight = 1 / residuals.spread(has.force, has.cloud, np.sqrt(self.alike) * has.recoil)
        return Form.of(residuals, weight, np.array(columns))
