"""`sling setup`: what a lab measured of itself, checked against itself, into bands/lab.yaml.

Tips, camera and floor are measured in the robot's base; `setup:` keeps the fork's frame O in the
base and in the camera, and its height above the floor. docs/recording.md, Calibration.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel
from scipy.spatial.transform import Rotation

from sling2sim2real.api.band_folder import (
    BANDS,
    lab_settings,
    lab_settings_of,
    mapping_of,
    plain,
    write_yaml,
)
from sling2sim2real.base.errors import UserError
from sling2sim2real.recording.frames import SURE, TOUCH, loop_of
from sling2sim2real.recording.transforms import Transform
from sling2sim2real.settings.lab import SetupParams

UPRIGHT = (0.0, 0.0, 1.0)
LEVEL = math.radians(2)  # of the line between the tips
VIEW = math.radians(45)  # from the camera's axis to the fork; lenses see less
NEAR = 0.05  # m before the camera
DIGITS = 5  # hundredths of a millimetre

Numbers = tuple[float, ...]


def set_up(measured: Mapping[str, Any], path: Path = BANDS / "lab.yaml") -> dict:
    """Check what was measured and write it into lab.yaml, whose comments may be lost.

    Args:
        measured: What was given of arguments.MEASURED by name, and `topics` by role [m, N, kg].

    Returns:
        `file`; `changed`: by key, `old` and `new`; `checked`: what agrees, in words.

    Raises:
        UserError: It contradicts itself or what is there; nothing is written.
    """
    measured = {name: value for name, value in measured.items() if value is not None}
    if not measured:
        raise UserError(
            "nothing to set up: give what you measured, such as --left-tip=0.7,0.14,0.42"
            " --right-tip=0.7,-0.14,0.42"
        )
    setup = lab_settings(path).setup
    new, checked = changes_of(measured, setup)
    old = {key: plain(_as_plain(getattr(setup, key))) for key in new}
    changed = {
        key: {"old": old[key], "new": plain(value)}
        for key, value in new.items()
        if old[key] != plain(value)
    }
    content = mapping_of(path) if path.is_file() else {}
    section = content.get("setup") or {}
    for key, change in changed.items():
        both = key == "topics" and isinstance(section.get(key), dict)
        section[key] = section[key] | change["new"] if both else change["new"]
    if changed:
        lab_settings_of(content | {"setup": section}, path)  # refuses what cannot be
        title = "What all bands of this lab share: settings that differ from the library's"
        write_yaml(path, content | {"setup": section}, title)
    return {"file": str(path), "changed": changed, "checked": checked}


def shown(content: dict) -> str:
    """What changes, and what was checked, in lines."""
    lines = [
        f"setup.{key}: {_text(change['old'])} -> {_text(change['new'])}"
        for key, change in content["changed"].items()
    ]
    lines = [*lines, f"wrote {content['file']}"] if lines else ["nothing changes"]
    return "\n".join([*lines, *(f"  {line}" for line in content["checked"])])


def changes_of(measured: Mapping[str, Any], setup: SetupParams) -> tuple[dict[str, Any], list[str]]:
    """New values of `setup`, by key, and what agrees, in words. Raises UserError."""
    new: dict[str, Any] = {}
    checked: list[str] = []
    for key in ("fork_width", "max_force", "draw_y", "draw_z"):
        if key in measured:
            new[key] = measured[key]
    if tool := measured.get("tool"):
        new["tool"] = {"mass": tool[0], "center": tool[1:]}
    if topics := measured.get("topics"):
        new["topics"] = dict(topics)
    width, tips = new.get("fork_width", setup.fork_width), ("left_tip", "right_tip")
    fork, camera, seen = (
        pose and Transform.of(pose)
        for pose in (
            setup.base_to_fork, measured.get("base_to_camera"), measured.get("camera_to_fork")
        )
    )  # fmt: skip

    if {*tips} <= {*measured}:
        left, right = (np.array(measured[name]) for name in tips)
        fork = fork_of(left, right)
        answers = "--fork-width" if "fork_width" in new else "setup.fork_width"
        checked.append(_agreed_width(float(np.linalg.norm(right - left)), width, answers))
        _expect_robot_behind(fork)
        new["base_to_fork"] = _pose(fork)
    elif {*tips} & {*measured}:
        raise UserError("the fork needs both tips: give --left-tip and --right-tip")
    elif camera is not None and seen is not None and fork is None:
        new["base_to_fork"] = _pose(camera @ seen)
    elif camera is not None and fork is None:
        raise UserError(
            "--base-to-camera: setup.base_to_fork is null, so the camera does not know where the"
            " fork is: give --left-tip and --right-tip too, or --camera-to-fork"
        )
    if camera is not None and seen is not None and fork is not None:
        words, explained = loop_of(fork, seen, camera, width)
        if not explained:
            raise UserError(f"{words}: measure the tips or the camera again")
        checked.append(f"base, camera and fork agree: {words}")
    fork = fork or (camera and seen and camera @ seen)
    seen = seen or (camera and fork and camera.inverse() @ fork)
    if seen is not None:
        checked.append(_looks_at_the_fork(seen))
        new["camera_to_fork"] = _pose(seen)

    if (floor := measured.get("floor")) is not None:
        if fork is None:
            raise UserError(
                "--floor: is in the robot's base, in which the fork is not known: give --left-tip"
                " and --right-tip too, or set setup.fork_height, the tips' height above the floor"
            )
        new["fork_height"] = _height(fork, floor)
    if seen is not None or floor is not None:
        _expect_above_the_floor(new, setup)
    return new, checked


def fork_of(left: np.ndarray, right: np.ndarray) -> Transform:
    """Frame O to the robot's base, from the tips there, shape (3,) each; the base stands level.

    Raises UserError where the tips are not level.
    """
    way, up = right - left, np.array(UPRIGHT)
    size = float(np.linalg.norm(way))
    if size < 0.02:
        raise UserError("--left-tip and --right-tip are the same place: touch one, then the other")
    tilt = math.asin(float(way @ up) / size)
    if abs(tilt) > LEVEL:
        higher = "right" if tilt > 0 else "left"
        raise UserError(
            f"the {higher} tip is {1e3 * abs(way @ up):.0f} mm higher than the other, which tilts"
            f" the fork by {math.degrees(abs(tilt)):.1f} degrees: level it, or touch the tips again"
        )
    x = way / size
    y = np.cross(up, x) / np.linalg.norm(np.cross(up, x))
    axes = np.stack([x, y, np.cross(x, y)], axis=1)
    return Transform(Rotation.from_matrix(axes), (left + right) / 2)


def _agreed_width(apart: float, width: float, answers: str) -> str:
    most = SURE * math.sqrt(2) * TOUCH
    if abs(apart - width) > most:
        off = 1e3 * abs(apart - width)
        raise UserError(
            f"the tips are {apart:.4f} m apart, {answers} is {width:.4f} m: {off:.1f} mm differ,"
            f" and touching explains {1e3 * most:.1f}: measure it with a ruler"
            " (--fork-width), and check the tool centre point"
        )
    return f"the tips are {apart:.4f} m apart, and fork_width is {width:.4f} m"


def _expect_robot_behind(fork: Transform) -> None:
    """The hand draws towards the robot: its base lies behind the fork."""
    ahead = float(fork.inverse().translation[1])
    if ahead > 0:
        raise UserError(
            f"the target would lie behind the robot, whose base is {ahead:.2f} m ahead of the fork:"
            " left and right are as seen from the hand that looks at the target; swap the tips"
        )


def _looks_at_the_fork(seen: Transform) -> str:
    """How the camera sees the fork. Raises UserError where it does not."""
    away, angle = _seen(seen)
    where = f"{math.degrees(angle):.0f} degrees off"
    if seen.translation[2] < NEAR or angle > VIEW:
        back = seen.inverse()
        inverse = back.translation[2] >= NEAR and _seen(back)[1] <= VIEW
        hint = "; the inverse pose would: is it the base in the camera?" if inverse else ""
        raise UserError(
            f"the camera does not look at the fork, which lies {where}"
            f" its axis, {away:.2f} m away: give the optical frame's pose (z ahead, x right, y"
            f" down){hint}"
        )
    return f"the fork lies {where} the camera's axis, {away:.2f} m away"


def _seen(fork: Transform) -> tuple[float, float]:
    """Distance [m], and angle from the axis [rad]."""
    away = float(np.linalg.norm(fork.translation))
    return away, math.acos(float(fork.translation[2]) / away) if away else 0.0


def _height(fork: Transform, floor: float) -> float:
    height = float(fork.translation[2]) - floor
    if height < 0.05:
        where = "above" if height < 0 else f"only {height:.3f} m below"
        raise UserError(
            f"--floor {floor:g}: the floor would lie {where} the fork, whose tips are at"
            f" {fork.translation[2]:.3f} m in the robot's base"
        )
    return round(height, DIGITS)


def _expect_above_the_floor(new: dict[str, Any], setup: SetupParams) -> None:
    seen = new.get("camera_to_fork", setup.camera_to_fork)
    height = new.get("fork_height", setup.fork_height)
    if seen is not None and (at := float(Transform.of(seen).inverse().translation[2])) < -height:
        raise UserError(
            f"the camera would stand {-at - height:.2f} m below the floor: check its pose, and"
            " setup.fork_height (--floor)"
        )


def _pose(transform: Transform) -> Numbers:
    return tuple(round(float(value), DIGITS) + 0.0 for value in transform.pose())


def _as_plain(value: object) -> object:
    return value.model_dump(exclude_none=True) if isinstance(value, BaseModel) else value


def _text(value: object) -> str:
    if isinstance(value, dict):
        return f"{{{', '.join(f'{key}: {_text(part)}' for key, part in value.items())}}}"
    if isinstance(value, list):
        return f"[{', '.join(map(_text, value))}]"
    if value is None:
        return "null"
    return f"{value:g}" if isinstance(value, float | int) else str(value)
