"""Export a calibrated band: match, prove, write a folder."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from inspect import getfile
from pathlib import Path

import numpy as np

from sling2sim2real.api.model import Model
from sling2sim2real.base.errors import UserError
from sling2sim2real.base.files import replacing_folder, write_json, write_text
from sling2sim2real.base.machine import device
from sling2sim2real.exporting import ENGINES, card, mjcf, newton_replay, usd
from sling2sim2real.exporting import samples as posterior_samples
from sling2sim2real.exporting.chain import SpringChain
from sling2sim2real.exporting.match import matched, proof_draws, proven
from sling2sim2real.exporting.mujoco_replay import MujocoBand


@dataclass(frozen=True)
class Exported:
    """What was written.

    Attributes:
        folder: With the files.
        met: Whether the replay in the target's engine came as near as is asked; None where nothing
            was simulated there.
        card: What card.json holds: values, matched parameters, what the match leaves.
    """

    folder: Path
    met: bool | None
    card: dict


def export(model: Model, to: str, out: str | Path, *, samples: int = 0) -> Exported:
    """Write a band for another engine into a folder, with a card that says what came out.

    Its parameters are matched to this simulation: the same force to hold a draw, the same landings.
    docs/export.md says for whom, and what stands in for what an engine cannot express.

    >>> import tempfile
    >>> from sling2sim2real import Band, Model, Settings, Theta, export
    >>> band = Band(mass=0.023, diameter=0.010, rest_length=0.52)
    >>> model = Model(band, Theta(2.0e5, 0.47, 2.4e-3, 0.7, 0.6), settings=Settings.coarse())
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     done = export(model, "usd", folder)
    ...     sorted(file.name for file in done.folder.iterdir())
    ['README.md', 'band.usda', 'card.json', 'nodes.json']

    Args:
        model: From `identify`, or written by hand.
        to: `mjcf` for MuJoCo; `newton` for Newton, which must be installed (extra `export`); `usd`
            for PhysX, to be matched there.
        out: Folder; what an export wrote there before is replaced.
        samples: Of the posterior, as parameters of the engine in samples.parquet; not for `usd`.

    Raises:
        UserError: No such target, what it needs is missing, the folder holds something else, the
            band cannot be matched, or has fewer samples.
    """
    folder = Path(out)
    if to not in TARGETS:
        raise UserError(f"to: must be one of {', '.join(TARGETS)}, got {to!r}")
    if folder.exists() and not replaceable(folder):
        raise UserError(f"{folder}: holds something else than an export; name an empty folder")
    posterior_samples.expect(model, samples, to)
    with replacing_folder(folder) as temporary:
        content = TARGETS[to](model, temporary, samples)
        write_json(temporary / "card.json", content)
    return Exported(folder, content.get("met"), content)


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


def to_mjcf(model: Model, folder: Path, count: int) -> dict:
    """The chain of mjcf.py, proven by a replay of the written file."""
    chain, proof = matched(model), proof_draws(model)
    path = folder / f"{model.band.name}.xml"
    write_text(path, mjcf.text(model.band.name, chain, _keys(chain, proof)))
    files = {path.name: "the model"}
    engine = MujocoBand(chain, path), MujocoBand, mjcf.sample
    return _proven(model, folder, "mjcf", files, engine, proof, count)


def to_newton(model: Model, folder: Path, count: int) -> dict:
    """<band>.json and newton_band.py, proven by a replay on the device of SLING_DEVICE.

    The chain is matched in MuJoCo, which steps the same springs the same way. All that is said
    about it is measured in Newton.
    """
    source = Path(getfile(newton_replay.loader()))
    chain, proof = matched(model), proof_draws(model)
    path = folder / f"{model.band.name}.json"
    write_json(path, newton_replay.numbers(model.band.name, chain, proof))
    write_text(folder / source.name, source.read_text("utf-8"))
    replay = partial(newton_replay.NewtonReplay, device=device())
    files = {path.name: "the numbers", source.name: "builds and launches the band"}
    engine = replay(chain), replay, newton_replay.sample
    return _proven(model, folder, "newton", files, engine, proof, count)


def _proven(
    model: Model,
    folder: Path,
    target: str,
    files: dict[str, str],
    engine: tuple[Replay, Callable[[SpringChain], Replay], Callable[[SpringChain], dict]],
    proof: np.ndarray,
    count: int,
) -> dict:
    """Prove a written chain and write its samples and README.md; what card.json holds.

    Args:
        engine: Replays the chain; replays another; what a sample changes of the files.
        proof: Draws (N, 2).
        count: Of samples.
    """
    replay, other, columns = engine
    done = proven(model, replay, proof)
    sampled = posterior_samples.write(
        model, replay.chain, folder, count, replay=other, columns=columns, proof=proof
    )
    files = files | {"README.md": "how to use it, and what came out"}
    if sampled:
        files[posterior_samples.FILE] = "samples of the posterior in parameters of the engine"
    content = card.content(model, done, target, files) | {"samples": sampled}
    if target == "newton":
        del content["springs_error"]  # the kernel has the law itself
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


Replay = MujocoBand | newton_replay.NewtonReplay
Target = Callable[[Model, Path, int], dict]
TARGETS: dict[str, Target] = dict(zip(ENGINES, (to_mjcf, to_newton, usd.to_usd), strict=True))
