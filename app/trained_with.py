"""What params.yaml said when a stage ran, against what it says now."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML, YAMLError

from pipeline.base.errors import UserError

# Where a policy's card has values of params.yaml; {} is the band.
CARD = {
    "policy.targets": ("input", "trained_range"),
    "setup.max_force": ("max_force_n",),
    "setup.fork_width": ("setup", "fork_width_m"),
    "setup.fork_height": ("setup", "fork_height_m"),
    "setup.projectile_mass": ("setup", "projectile_mass_kg"),
    "setup.arm_stiffness": ("setup", "arm_stiffness_n_m"),
    "bands.{}.mass": ("setup", "band_mass_kg"),
    "bands.{}.diameter": ("setup", "band_diameter_m"),
    "bands.{}.rest_length": ("setup", "band_rest_length_m"),
}
MISSING = "not there"


@dataclass(frozen=True)
class Change:
    """A key of params.yaml with its value then and now; MISSING where it was or is not there."""

    key: str
    old: Any
    new: Any

    def __str__(self) -> str:
        return f"{self.key} was {_short(self.old)}, is {_short(self.new)}"


def since_run(root: Path, stage: str | None) -> list[Change] | None:
    """What has changed since dvc.lock was told of a stage, and of those whose outputs it reads.

    None where there is no such stage, or dvc.lock does not know it.
    """
    stages = _read(root / "dvc.lock").get("stages", {})
    if stage not in stages:
        return None
    makers = {out["path"]: name for name, one in stages.items() for out in one.get("outs", ())}
    now, found, todo = _read(root / "params.yaml"), {}, [stage]
    for name in todo:  # which grows
        for change in _changes(stages[name].get("params", {}).get("params.yaml", {}), now):
            found.setdefault(change.key, change)
        deps = [dep["path"] for dep in stages[name].get("deps", ())]
        todo += sorted({maker for path in deps if (maker := _maker(makers, path))} - {*todo})
    return [found[key] for key in sorted(found)]


def since_card(root: Path, band: str, card: dict) -> list[Change]:
    """What has changed since a policy's card was written, as far as the card tells."""
    then = {}
    for key, path in CARD.items():
        value = card
        for part in path:
            value = value.get(part, MISSING) if isinstance(value, dict) else MISSING
        if value != MISSING:
            then[key.format(band)] = value
    return _changes(then, _read(root / "params.yaml"))


def _maker(makers: dict[str, str], path: str) -> str | None:
    """The stage that makes a file, or something in a folder."""
    inside = (name for out, name in makers.items() if out.startswith(f"{path}/"))
    return makers.get(path) or next(inside, None)


def _changes(then: dict[str, Any], now: dict) -> list[Change]:
    found = []
    for key, old in sorted(then.items()):
        new = now
        for part in key.split("."):
            new = new.get(part, MISSING) if isinstance(new, dict) else MISSING
        found += _differences(key, old, new)
    return list({one.key: one for one in found}.values())


def _differences(key: str, old: Any, new: Any) -> Iterator[Change]:
    if isinstance(old, dict) and isinstance(new, dict):
        for name in dict.fromkeys([*old, *new]):
            yield from _differences(f"{key}.{name}", old.get(name, MISSING), new.get(name, MISSING))
    elif old != new:
        yield Change(key, old, new)


def _short(value: Any) -> str:
    text = "null" if value is None else str(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def _read(path: Path) -> dict:
    """{} where there is no such file. Raises UserError."""
    try:
        content = YAML(typ="safe").load(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return {}
    except (OSError, ValueError, YAMLError) as error:
        raise UserError(f"{path}: damaged; `git checkout {path.name}` brings it back") from error
    return content if isinstance(content, dict) else {}
