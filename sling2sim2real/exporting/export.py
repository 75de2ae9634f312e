"""Export a calibrated band: match, prove, write a folder."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import partial
from inspect import getfile
from pathlib import Path

import numpy as np

from sling2sim2real.base.errors import UserError
from sling2sim2real.base.files import replacing_folder, write_json, write_text
from sling2sim2real.base.machine import device
from sling2sim2real.exporting import ENGINES, card, mjcf, newton_replay, samples, usd
from sling2sim2real.exporting.band import CalibratedBand
from sling2sim2real.exporting.chain import SpringChain
from sling2sim2real.exporting.match import matched, proof_draws
from sling2sim2real.exporting.mujoco_replay import MujocoBand
from sling2sim2real.exporting.proof import Matched, proven


def write(
    model: CalibratedBand,
    to: str,
    folder: Path,
    count: int = 0,
) -> dict:
    """What sling2sim2real.export does; what card.json holds. `to` is a key of TARGETS.

    Args:
        count: Of samples.

    Raises UserError.
    """
    if to not in TARGETS:
        raise UserError(f"to: must be one of {', '.join(TARGETS)}, got {to!r}")
    if folder.exists() and not replaceable(folder):
        raise UserError(f"{folder}: holds something else than an export; name an empty folder")
    samples.expect(model, count, to)
    with replacing_folder(folder) as temporary:
        content = TARGETS[to](model, temporary, count)
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


def to_mjcf(model: CalibratedBand, folder: Path, count: int) -> dict:
    """The chain of mjcf.py, proven by a replay of the written file."""
    name, chain, proof = model.band.name, matched(model), proof_draws(model)
    path = folder / f"{name}.xml"
    write_text(path, mjcf.text(name, chain, _keys(chain, proof)))
    done = proven(model, MujocoBand(chain, path), proof)
    sampled = samples.write(
        model, chain, folder, count, replay=MujocoBand, columns=mjcf.sample, proof=proof
    )
    files = {path.name: "the model"}
    return _chain_card(model, folder, "mjcf", done, files, sampled, mjcf.VERSION)


def to_newton(model: CalibratedBand, folder: Path, count: int) -> dict:
    """<band>.json and newton_band.py, proven by a replay on the device of SLING_DEVICE.

    The chain is matched in MuJoCo, which steps the same springs the same way. All that is said
    about it is measured in Newton.
    """
    source = Path(getfile(newton_replay.loader()))
    name, chain, proof = model.band.name, matched(model), proof_draws(model)
    path = folder / f"{name}.json"
    write_json(path, newton_replay.numbers(name, chain, proof))
    write_text(folder / source.name, source.read_text("utf-8"))
    replay = partial(newton_replay.NewtonReplay, device=device())
    done = proven(model, replay(chain), proof)
    sampled = samples.write(
        model, chain, folder, count, replay=replay, columns=newton_replay.sample, proof=proof
    )
    files = {path.name: "the numbers", source.name: "builds and launches the band"}
    return _chain_card(model, folder, "newton", done, files, sampled)


def _chain_card(
    model: CalibratedBand,
    folder: Path,
    target: str,
    done: Matched,
    files: dict[str, str],
    sampled: dict | None,
    version: str | None = None,
) -> dict:
    """What card.json holds of a proven chain; writes README.md."""
    files = files | {"README.md": "how to use it, and what came out"}
    if sampled:
        files[samples.FILE] = "samples of the posterior in parameters of the engine"
    content = card.content(model, done, target, files) | {"samples": sampled}
    if target == "newton":
        del content["springs_error"]  # the kernel has the law itself
    write_text(folder / "README.md", card.readme(content, version=version))
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


Target = Callable[[CalibratedBand, Path, int], dict]
TARGETS: dict[str, Target] = dict(zip(ENGINES, (to_mjcf, to_newton, usd.to_usd), strict=True))
