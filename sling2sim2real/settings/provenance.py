"""The settings that a policy rests on, as its card stores them under `made_with`."""

from __future__ import annotations

from typing import Any

from sling2sim2real.settings import Settings

SETUP = {
    "air_density",
    "arm_stiffness",
    "clamp_direction",
    "draw_y",
    "draw_z",
    "finger_opening_time",
    "foot_height",
    "fork_height",
    "fork_width",
    "grip_force",
    "max_force",
    "projectile_mass",
}
SLING = {"edges", "grading", "launch_step", "launch_time"}


def policy_settings_of(params: Settings, band: str) -> dict[str, Any]:
    """Sections and keys of params.yaml that a policy rests on beside its θ, as JSON has them."""
    whole = dict.fromkeys(("launch", "policy"), True)
    parts = {"bands": {band}, "setup": SETUP, "sling": SLING}
    return params.model_dump(mode="json", include=whole | parts)
