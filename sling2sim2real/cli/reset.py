"""params.yaml back to what Git has: after an experiment, a preset, or a value that was refused."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator, Sequence
from pathlib import Path

from ruamel.yaml import YAML, YAMLError

from pipeline.params import Params
from sling2sim2real.base.errors import UserError, one_line
from sling2sim2real.base.files import write_text
from sling2sim2real.cli.params_file import edited

YOURS = (("bands",), ("run", "own"), ("setup",), ("plan",))  # of a lab, not of an experiment
Key = tuple[str, ...]


def reset(keys: Sequence[str], path: Path | str = "params.yaml") -> list[str]:
    """Give keys of params.yaml the values that the last commit has.

    Args:
        keys: Such as optimizer.k_top or optimizer; none: all but those that describe a lab and its
            bands, `YOURS`. What the commit has not, such as a method of one's own, stays.
        path: Of the params.yaml, which may hold a value that is refused.

    Returns:
        What was and is, a line each changed key.

    Raises:
        UserError: A key is not in the commit, there is no commit, or what comes of it is no
            params.yaml; nothing is written.
    """
    path = Path(path)
    try:
        text = path.read_text("utf-8")
        now = YAML(typ="safe").load(text)
    except (OSError, UnicodeDecodeError, YAMLError) as error:
        raise UserError(f"{path}: cannot be read ({one_line(error)})") from error
    committed = YAML(typ="safe").load(_committed(path))
    requested = [tuple(key.split(".")) for key in keys]
    leaves = dict(_leaves(committed))
    for key in requested:
        if not any(_within(leaf, key) for leaf in leaves):
            raise UserError(f"{'.'.join(key)}: the last commit's {path.name} has no such key")
    changed = {}
    for leaf, value in leaves.items():
        mine = any(_within(leaf, key) for key in YOURS)
        wanted = any(_within(leaf, key) for key in requested) if requested else not mine
        if wanted and _value(now, leaf) != value:
            changed[leaf] = value
    if not changed:
        return []
    back = edited(text, lambda content: [_set(content, *change) for change in changed.items()])
    Params.parse(back, str(path))
    write_text(path, back)
    return [f"{'.'.join(k)} was {_value(now, k)}, is {v} again" for k, v in changed.items()]


def _committed(path: Path) -> str:
    command = ["git", "show", f"HEAD:./{path.name}"]
    try:
        done = subprocess.run(
            command, cwd=path.absolute().parent, capture_output=True, text=True, check=False
        )
    except OSError as error:
        raise UserError(f"git: cannot be run ({error.strerror})") from error
    if done.returncode:
        raise UserError(f"{path}: Git has no committed one ({one_line(done.stderr)})")
    return done.stdout


def _leaves(node: dict, above: Key = ()) -> Iterator[tuple[Key, object]]:
    """Values by their keys; a list is one value, and so is an empty mapping."""
    for key, value in node.items():
        if isinstance(value, dict) and value:
            yield from _leaves(value, (*above, str(key)))
        else:
            yield (*above, str(key)), value


def _within(leaf: Key, key: Key) -> bool:
    return leaf[: len(key)] == key


def _value(node: object, key: Key) -> object:
    for part in key:
        node = node.get(part) if isinstance(node, dict) else None
    return node


def _set(node: dict, key: Key, value: object) -> None:
    for part in key[:-1]:
        if not isinstance(node.get(part), dict):
            node[part] = {}
        node = node[part]
    node[key[-1]] = value
