"""The settings that a θ file or a policy rests on, and how those of today differ from them.

They are stored in the file itself, under `made_with`, flat: {"setup.fork_width": 0.275, ...}. The
budget and the seed of a search are not among them: another θ shows by its values.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from sling2sim2real.settings import Settings

RECORDING = ("force", "cloud", "episode")  # whole sections
RECORDED_SETUP = ("base_to_fork", "camera_to_fork", "tip_link", "tool", "topics", "urdf")
PULL_SETUP = ("air_density", "clamp_direction", "finger_opening_time", "fork_width", "grip_force")
LAUNCH_SETUP = ("arm_stiffness", "foot_height", "fork_height", "projectile_mass")
POLICY_SETUP = ("draw_y", "draw_z", "max_force")
MESH = ("edges", "grading")
PULL_STEPS = ("grip_step", "hold_step", "recoil_step", "recoil_time", "swing_step")
LAUNCH_STEPS = ("launch_step", "launch_time")
METHOD = ("bounds", "engine", "fixed", "law", "mounting", "search", "weights")
NOT_THERE = "not there"


@dataclass(frozen=True)
class Change:
    """A key of params.yaml with its value then and now; NOT_THERE where it was or is missing."""

    key: str
    old: Any
    new: Any

    def __str__(self) -> str:
        return f"{self.key} was {_short(self.old)}, is {_short(self.new)}"


def settings_of(params: Settings, band: str, method: str) -> dict[str, Any]:
    """The settings that θ of a band and a method rests on, by their keys in params.yaml.

    But for those of launches that are evidence: `evidence_settings_of`. Values are those of JSON:
    numbers, texts, lists, None.
    """
    settings = flat(f"bands.{band}", params.bands[band])
    for name in RECORDING:
        settings |= flat(name, getattr(params, name))
    settings |= _part(params, "setup", *RECORDED_SETUP, *PULL_SETUP)
    settings |= _part(params, "sling", *MESH, *PULL_STEPS)
    settings |= flat("loss", params.loss) | flat("parameters", params.parameters)
    for name in METHOD:
        settings |= flat(f"methods.{method}.{name}", getattr(params.methods[method], name))
    return settings


def evidence_settings_of(params: Settings) -> dict[str, Any]:
    """The settings that launches as evidence rest on, as `settings_of` gives them."""
    return _launch(params) | {"trials.actuation_error": params.trials.actuation_error}


def policy_settings_of(params: Settings, band: str) -> dict[str, Any]:
    """The settings that a policy rests on beside its θ, as `settings_of` gives them."""
    settings = flat(f"bands.{band}", params.bands[band])
    settings |= _launch(params) | flat("launch", params.launch)
    settings |= _part(params, "setup", *PULL_SETUP, *POLICY_SETUP)
    return settings | _part(params, "sling", *MESH) | flat("policy", params.policy)


def changes(then: Mapping[str, Any], now: Mapping[str, Any]) -> list[Change]:
    """What differs between two sets of settings, sorted by key."""
    keys = sorted({*then, *now})
    compared = (Change(key, then.get(key, NOT_THERE), now.get(key, NOT_THERE)) for key in keys)
    return [change for change in compared if change.old != change.new]


def changed_since(params: Settings, content: Mapping[str, Any], method: str) -> list[Change]:
    """What has changed since the θ of a file's content was identified, as far as it tells."""
    then = content.get("made_with")
    if not then or method not in params.methods:
        return []
    now = settings_of(params, content["band"], method)
    if (content.get("confidence") or {}).get("launches"):
        now |= evidence_settings_of(params)
    return changes(then, now)


def _launch(params: Settings) -> dict[str, Any]:
    return _part(params, "setup", *LAUNCH_SETUP) | _part(params, "sling", *LAUNCH_STEPS)


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


def _short(value: Any) -> str:
    text = "null" if value is None else str(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
