"""The hand's pose for a draw, in the robot's base: how a robot carries out what `aim` says.

The projectile sits at the band's middle, between the finger tips: at the tool centre point, whose
pose the recording tracked. The hand's z points from the draw through the origin, its x along the
fork (app/plan/hand.py), so that band, hand and launch lie in one plane: "we align the
projectile direction (i.e., elevation angle) with the plane formed by the stretched sling".
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import cast

import numpy as np

from app.aim import Answer
from app.plan.hand import along_pull, quaternion
from app.safety import Hazard
from pipeline.base.errors import UserError
from pipeline.base.layout import Layout
from pipeline.params import Params
from pipeline.params.lab import SetupParams
from pipeline.recording.input.frames import Transform


class PosedAnswer(Answer):
    """With the hand's pose for the draw: None, with a warning, where the fork is unknown."""

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
    """Frame O to the robot's base, and the base's name, as the band's first recording has them.

    There, setup.base_to_fork comes before /tf_static; without a recording that can be read it
    stands alone, and plan.frame names the base. Raises UserError where neither tells.
    """
    given = params.setup.base_to_fork
    try:
        fork, frame = _recorded(Layout(Path(root)), band, params.setup)
    except UserError:
        if given is None:
            raise
        fork, frame = Transform.of(given), ""
    return fork, frame or params.plan.frame


def _recorded(layout: Layout, band: str, setup: SetupParams) -> tuple[Transform, str]:
    recordings = layout.recordings(band)
    if not recordings:
        raise UserError(
            f"setup.base_to_fork is null and {layout.raw(band)} holds no recording: measure where"
            " the fork stands (docs/recording.md, Calibration)"
        )
    from pipeline.recording.geometry import geometry_of
    from pipeline.recording.input.reader import read_recording

    recording = read_recording(recordings[0], setup)
    return geometry_of(recording, setup).base.inverse(), recording.pose.frame
