"""The hand's pose for a draw, in the robot's base: how a robot carries out what `aim` says.

The projectile sits at the band's middle, between the finger tips: at the tool centre point, whose
pose the recording tracked. The hand's z points from the draw through the origin, its x along the
fork (plan/hand.py), so that band, hand and launch lie in one plane: "we align the
projectile direction (i.e., elevation angle) with the plane formed by the stretched sling".
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import cast

import numpy as np

from pipeline.params import Params
from sling2sim2real.base.errors import UserError
from sling2sim2real.base.layout import Layout
from sling2sim2real.cli.aim import Answer
from sling2sim2real.cli.plan.hand import along_pull, quaternion
from sling2sim2real.cli.safety import Hazard
from sling2sim2real.episode.episode import read_metadata
from sling2sim2real.recording.frames import EpisodeGeometry
from sling2sim2real.recording.transforms import Transform
from stages.start import stage_of


class PosedAnswer(Answer):
    """Answer with the hand's pose for the draw: None, with a warning, where the fork is unknown."""

    pitch_rad: float  # of the launch, above the horizon
    tcp_frame: str | None  # the robot's base
    tcp_position_m: list[float] | None  # of the tool centre point, there
    tcp_quaternion_xyzw: list[float] | None


def posed(answer: Answer, params: Params, band: str, root: str | Path = ".") -> PosedAnswer:
    """The answer of `aim` with the hand's pose for its draw, before its warnings."""
    drawn = np.array([0.0, answer["draw_y_m"], answer["draw_z_m"]])
    warnings, frame, position, turn = list(answer["warnings"]), None, None, None
    try:
        fork, frame = fork_in_base(params, band, root)
    except UserError as error:
        warnings.append(Hazard("pose", f"no pose of the hand in the robot's base: {error}"))
    else:
        position = [round(float(value), 6) + 0.0 for value in fork.apply(drawn)]
        turn = quaternion(fork.rotation * along_pull(drawn)).tolist()
    pose = {
        **{name: value for name, value in answer.items() if name != "warnings"},
        "pitch_rad": math.atan2(-drawn[2], -drawn[1]),
        "tcp_frame": frame,
        "tcp_position_m": position,
        "tcp_quaternion_xyzw": turn,
        "warnings": warnings,
    }
    return cast(PosedAnswer, pose)


def fork_in_base(params: Params, band: str, root: str | Path = ".") -> tuple[Transform, str]:
    """Frame O to the robot's base, and the base's name, as the band's first episode has them.

    setup.base_to_fork comes before the episode's; without an episode it stands alone, and
    plan.frame names the base. Raises UserError where neither tells.
    """
    given, folder = params.setup.base_to_fork, Layout(Path(root)).episode(band)
    try:
        geometry = EpisodeGeometry.of_episode(read_metadata(folder), band)
    except UserError as error:
        if given is None:
            stage = stage_of(params, "episode", band) or f"episode@{band}"
            raise UserError(
                f"setup.base_to_fork is null and no episode says where the fork stands ({error}):"
                f" make one (`dvc repro {stage}`), or measure it"
                " (docs/recording.md, Calibration)"
            ) from error
        return Transform.of(given), params.plan.frame
    fork = geometry.base_to_fork if given is None else Transform.of(given)
    return fork, geometry.base_frame or params.plan.frame
