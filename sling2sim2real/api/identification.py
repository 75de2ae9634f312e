"""An identified band: its θ, how sure that is, and how both are kept."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from sling2sim2real.api.band_folder import BandFolder
from sling2sim2real.api.model import Band, Model, Theta
from sling2sim2real.base.errors import UserError
from sling2sim2real.base.files import NotMade, write_json
from sling2sim2real.base.schema import JsonRecord, Pose, read_json
from sling2sim2real.episode.episode import Episode
from sling2sim2real.identification.results.theta import Mounting, ThetaFile
from sling2sim2real.launching.surface.stored import Stored
from sling2sim2real.quantities import QUANTITIES
from sling2sim2real.settings import Settings
from sling2sim2real.simulator.model import LaunchHistory
from sling2sim2real.simulator.parameters import Parameters

METHOD = "posterior"


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
    policy: Stored | None = field(default=None, repr=False, compare=False)
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
        policy = Stored.of_band(folder.path)
        return replace(
            found,
            policy=policy if policy.network.is_file() else None,
            stale=file.digest is not None and file.digest != folder.digest,
        )


def fork_of(episode: Episode) -> Fork | None:
    """Where its recording has the fork; None of an episode that was made of arrays."""
    geometry = episode.metadata.get("geometry")
    return geometry and Fork(pose=geometry["base_to_fork"], frame=geometry["base_frame"])


def _intervals(theta: dict, confidence: dict) -> dict[str, Interval]:
    """Intervals by name, of a θ file's content."""
    result = {}
    for name, parameter in confidence["parameters"].items():
        ends = parameter["low"], parameter["high"], parameter["identifiable"]
        result[name] = Interval(theta[name], *ends, QUANTITIES[name].si)
    for name, parameter in confidence["derived"].items():
        value, low, high = (float(parameter[key]) for key in ("value", "low", "high"))
        result[name] = Interval(value, low, high, True, parameter["unit"])
    return result
