"""The settings that a policy rests on, as its card stores them under `made_with`.

They are flat: {"setup.fork_width": 0.275, ...}.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from sling2sim2real.settings import Settings

SETUP = (
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
)
SLING = ("edges", "grading", "launch_step", "launch_time")


def policy_settings_of(params: Settings, band: str) -> dict[str, Any]:
    """The settings that a policy rests on beside its θ, by their keys in params.yaml.

    Values are those of JSON: numbers, texts, lists, None.
    """
    settings = flat(f"bands.{band}", params.bands[band]) | flat("launch", params.launch)
    settings |= _part(params, "setup", *SETUP) | _part(params, "sling", *SLING)
    return settings | flat("policy", params.policy)


def _part(params: Settings, section: str, *names: str) -> dict[str, Any]:
    values = getattr(params, section)
    return dict(
        leaf for name in names for leaf in _leaves(f"{section}.{name}", getattr(values, name))
    )


def flat(key: str, value: Any) -> dict[str, Any]:
    """All values below a section or mapping, by their keys."""
    return dict(_leaves(key, value))


def _leaves(key: str, value: Any) -> Iterator[tuple[str, Any]]:
    """A value, or those below it, by their keys."""
    if value is None or isinstance(value, bool | int | float | str):
        yield key, value
    elif isinstance(value, list | tuple):
        yield key, [*value]
    else:  # a section yields its names and values, as a mapping's items do
        for name, part in value.items() if isinstance(value, Mapping) else value:
            yield from _leaves(f"{key}.{name}", part)
