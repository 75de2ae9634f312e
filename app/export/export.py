"""Export an identified band: match, prove, write a folder."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path

from app.arguments import ENGINES
from app.export import card, mjcf, mjcf_card, newton_file, usd, yaml_file
from app.export.match import compared, draws_of, matched, proof_draws
from app.export.mujoco_replay import MujocoBand, mujoco
from app.export.pull import compare_pull
from pipeline.base.errors import UserError
from pipeline.base.files import replacing_folder, write_json, write_text
from pipeline.base.layout import Layout
from pipeline.episode.episode import Episode
from pipeline.params import Params, expect_known
from sling2sim2real.identification import Identification
from sling2sim2real.model import Model
from sling2sim2real.simulation import pull


def write(model: Model, to: str, folder: Path, episode: Episode | None = None) -> dict:
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


def of_run(
    params: Params, band: str, method: str, to: str, out: Path | None = None, root: str | Path = "."
) -> tuple[Path, dict]:
    """Export a band of a project, as `sling fit` or `dvc repro` found it: folder and card.

    Raises UserError.
    """
    expect_known(params, "band", band)
    expect_known(params, "method", method)
    found, layout = Identification.of_run(band, method, root), Layout(Path(root))
    there = layout.episode(band).is_dir()
    episodes = Episode.load_all(layout.episodes(band)) if there else [None]
    folder = out or layout.data / "exports" / band / to
    return folder, write(found, to, folder, episodes[0])


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
    known = set(files) if isinstance(files, dict) else set()
    return there <= known | {"card.json", "README.md"} and bool(known)


def to_mjcf(model: Model, folder: Path, episode: Episode | None) -> dict:
    """The chain of mjcf.py, proven by a replay of the written file."""
    engine = f"MuJoCo {version(mujoco().__name__)}"
    name, chain = model.band.name, matched(model)
    path, proof = folder / f"{name}.xml", proof_draws(model)
    write_text(path, mjcf.text(name, chain, _keys(name, chain, proof)))

    replay = MujocoBand(path, chain)
    draws = draws_of(model)
    shots = [replay.launch(draw, fly=True) for draw in proof]
    half = replace(chain, step=chain.step / 2)
    finer = MujocoBand(mjcf.text(name, half), half)
    moved = [
        finer.launch(draw).landing / shot.landing - 1
        for draw, shot in zip(proof, shots, strict=True)
    ]
    done = card.Matched(
        chain=chain,
        match=compared(model, draws, [replay.launch(draw) for draw in draws]),
        proof=compared(model, proof, shots),
        pull=compare_pull(model, episode or pull(model, tuple(proof[-1])), replay),
        finer=max(map(abs, moved)),
        engine=engine,
    )
    files = {path.name: "the model", "README.md": "how to use it, and what came out"}
    content = card.content(model, done, "mjcf", files)
    springs = content["springs_error"]
    how = mjcf_card.how(path.name, chain.step, content["time_step_error"], springs)
    write_text(folder / "README.md", card.readme(content, how))
    return content


def _keys(name: str, chain, proof) -> dict[str, dict]:
    """Keyframes: hanging, and drawn for each draw of the proof."""
    replay, keys = MujocoBand(mjcf.text(name, chain), chain), {}
    replay.hang()
    keys["hanging"] = replay.key()
    for i, draw in enumerate(proof, 1):
        replay.draw(draw)
        keys[f"draw{i}"] = replay.key()
    return keys


Target = Callable[[Model, Path, Episode | None], dict]
TARGETS: dict[str, Target] = dict(
    zip(ENGINES, (to_mjcf, newton_file.to_newton, yaml_file.to_yaml, usd.to_usd), strict=True)
)


def shown(folder: Path, content: dict) -> str:
    """What `sling export` prints."""
    lines = [f"{folder}: {', '.join(sorted([*content['files'], 'card.json']))}"]
    for row in content.get("proof", []):
        lines.append(
            f"draw {row['draw_y_m']:.3f}, {row['draw_z_m']:.3f} m:"
            f" hold {row['hold_force_n']:.2f} N ({100 * row['hold_force_error']:+.1f} % there),"
            f" landing {row['landing_m']:.2f} m ({100 * row['landing_error']:+.1f} % there)"
        )
    if "proof" in content:
        lines.append(
            f"{content['engine']}, draws that took no part in the match: asked"
            f" {100 * card.HOLD:g} and {100 * card.LANDING:g} %, "
            + ("met" if content["met"] else "NOT met")
        )
    return "\n".join(lines)
