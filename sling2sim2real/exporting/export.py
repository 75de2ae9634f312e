"""Export a calibrated band: match, prove, write a folder."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np

from sling2sim2real.base.errors import UserError
from sling2sim2real.base.files import replacing_folder, write_json, write_text
from sling2sim2real.episode.episode import Episode
from sling2sim2real.exporting import ENGINES, card, mjcf, newton_file, usd
from sling2sim2real.exporting.band import CalibratedBand
from sling2sim2real.exporting.chain import SpringChain
from sling2sim2real.exporting.match import matched, proof_draws
from sling2sim2real.exporting.mujoco_replay import MujocoBand
from sling2sim2real.exporting.proof import proven


def write(model: CalibratedBand, to: str, folder: Path, episode: Episode | None = None) -> dict:
    """What sling2sim2real.export does; what card.json holds. `to` is a key of TARGETS.

    Raises UserError.
    """
    if to not in TARGETS:
        raise UserError(f"to: must be one of {', '.join(TARGETS)}, got {to!r}")
    if folder.exists() and not replaceable(folder):
        raise UserError(f"{folder}: holds something else than an export; name an empty folder")
    with replacing_folder(folder) as temporary:
        content = TARGETS[to](model, temporary, episode)
        write_json(temporary / "card.json", content)
    return content


def replaceable(folder: Path) -> bool:
    """Whether a folder holds nothing but an earlier export."""
    if not folder.is_dir():
        return False
    there = {file.name for file in folder.iterdir()}
    try:
        card = json.loads((folder / "card.json").read_text("utf-8"))
    except (OSError, ValueError):
        return not there
    files = card.get("files") if isinstance(card, dict) and "target" in card else None
    listed = set(files) if isinstance(files, dict) else set()
    return there <= listed | {"card.json", "README.md"} and bool(listed)


def to_mjcf(model: CalibratedBand, folder: Path, episode: Episode | None) -> dict:
    """The chain of mjcf.py, proven by a replay of the written file."""
    name, chain = model.band.name, matched(model)
    path, proof = folder / f"{name}.xml", proof_draws(model)
    write_text(path, mjcf.text(name, chain, _keys(chain, proof)))
    done = proven(model, MujocoBand(chain, path), proof, episode)
    files = {path.name: "the model", "README.md": "how to use it, and what came out"}
    content = card.content(model, done, "mjcf", files)
    write_text(folder / "README.md", card.readme(content, version=mjcf.VERSION))
    return content


def _keys(chain: SpringChain, proof: np.ndarray) -> dict[str, dict[str, np.ndarray]]:
    """Keyframes: hanging, and drawn for each draw of the proof."""
    replay = MujocoBand(chain)
    replay.hang()
    keys = {"hanging": replay.key()}
    for i, draw in enumerate(proof, 1):
        replay.draw(draw)
        keys[f"draw{i}"] = replay.key()
    return keys


Target = Callable[[CalibratedBand, Path, Episode | None], dict]
TARGETS: dict[str, Target] = dict(
    zip(ENGINES, (to_mjcf, newton_file.to_newton, usd.to_usd), strict=True)
)
