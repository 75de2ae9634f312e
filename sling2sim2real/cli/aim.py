"""What `sling aim` and `sling launch` say: numbers, the hand's pose for a draw, and warnings.

The projectile sits at the band's middle, between the finger tips: at the tool centre point, whose
pose the recording tracked. The hand's z points from the draw through the origin, its x along the
fork (cli/plan/hand.py), so that band, hand and launch lie in one plane: "we align the
projectile direction (i.e., elevation angle) with the plane formed by the stretched sling".
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable
from dataclasses import asdict
from typing import Any

import numpy as np

from sling2sim2real.api.identification import Identification
from sling2sim2real.api.launching import Aim, Hazard, Launch
from sling2sim2real.cli import arguments as kinds
from sling2sim2real.cli.plan.hand import along_pull, quaternion
from sling2sim2real.recording.transforms import Transform

NO_POSE = (
    "no pose of the hand in the robot's base: no recording says where the fork stands there;"
    " `sling setup` takes it down"
)


def of_launch(launched: Launch) -> dict[str, Any]:
    """What `sling launch --json` says."""
    return {
        "landing_y_m": kinds.finite(launched.landing),
        "interval_90_m": _listed(launched.interval_90),
        "speed_m_s": kinds.finite(launched.speed),
        "hold_force_n": kinds.finite(launched.hold_force),
        **_asked(launched),
        "failure": launched.failure,
        "warnings": launched.warnings,
    }


def of_aim(aimed: Aim, found: Identification) -> dict[str, Any]:
    """What `sling aim --json` says; the pose is None, with a warning, where the fork is unknown."""
    launched, drawn = aimed.launch, np.array([0.0, *aimed.draw])
    warnings, frame, position, turn = list(aimed.warnings), None, None, None
    if placed := fork_in_base(found):
        fork, frame = placed
        position = [round(float(value), 6) + 0.0 for value in fork.apply(drawn)]
        turn = quaternion(fork.rotation * along_pull(drawn)).tolist()
    else:
        warnings.append(Hazard("pose", NO_POSE))
    return {
        "draw_y_m": aimed.draw[0],
        "draw_z_m": aimed.draw[1],
        "predicted_landing_m": kinds.finite(launched.landing),
        "interval_90_m": _listed(launched.interval_90),
        "hold_force_n": kinds.finite(launched.hold_force),
        "max_force_n": found.settings.setup.max_force,
        **_asked(launched),
        "pitch_rad": math.atan2(-drawn[2], -drawn[1]),
        "tcp_frame": frame,
        "tcp_position_m": position,
        "tcp_quaternion_xyzw": turn,
        "warnings": warnings,
    }


def fork_in_base(found: Identification) -> tuple[Transform, str] | None:
    """Frame O to the robot's base, and the base's name; setup.base_to_fork comes first."""
    given, recorded = found.settings.setup.base_to_fork, found.fork
    pose = given or (recorded and recorded.pose)
    if pose is None:
        return None
    return Transform.of(pose), (recorded and recorded.frame) or found.settings.plan.frame


def shown(answer: dict[str, Any], as_json: bool) -> str:
    """An answer with its `warnings`, which are printed first: as one JSON object, or as lines."""
    tell(answer["warnings"])
    if as_json:
        warnings = [asdict(hazard) for hazard in answer["warnings"]]
        return kinds.shown({**answer, "warnings": warnings}, True)
    return kinds.shown({k: v for k, v in answer.items() if k != "warnings"}, False)


def tell(hazards: Iterable[Hazard]) -> None:
    """Print hazards on stderr, a line each."""
    for hazard in hazards:
        print(f"warning: {hazard}", file=sys.stderr)


def _asked(launched: Launch) -> dict[str, list[float]]:
    """What a launch takes for granted of the hand, where the law remembers it."""
    times = launched.pull_and_pause
    return {"pull_and_pause_s": list(times)} if times else {}


def _listed(interval: tuple[float, float] | None) -> list[float] | None:
    return None if interval is None else list(interval)
