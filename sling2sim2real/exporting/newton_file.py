"""The chain as numbers and a loader for Newton, which need nothing of this project."""

from __future__ import annotations

from inspect import getfile
from pathlib import Path

from sling2sim2real.base.files import write_json, write_text
from sling2sim2real.base.machine import devices
from sling2sim2real.episode.episode import Episode
from sling2sim2real.exporting import card
from sling2sim2real.exporting.band import CalibratedBand
from sling2sim2real.exporting.match import matched, proof_draws
from sling2sim2real.exporting.newton_replay import NewtonReplay, loader, numbers
from sling2sim2real.exporting.proof import proven


def to_newton(model: CalibratedBand, folder: Path, episode: Episode | None) -> dict:
    """<band>.json and newton_band.py, proven by a replay on the first device of SLING_DEVICE.

    The chain is matched in MuJoCo, which steps the same springs the same way. All that is said
    about it is measured in Newton.
    """
    source = Path(getfile(loader()))
    name, chain = model.band.name, matched(model)
    proof = proof_draws(model)
    path = folder / f"{name}.json"
    write_json(path, numbers(name, chain, proof))
    write_text(folder / source.name, source.read_text("utf-8"))
    done = proven(model, NewtonReplay(chain, devices()[0]), proof, episode)
    files = {
        path.name: "the numbers",
        source.name: "builds and launches the band",
        "README.md": "how to use it, and what came out",
    }
    content = card.content(model, done, "newton", files)
    del content["springs_error"]  # the kernel has the law itself
    write_text(folder / "README.md", card.readme(content))
    return content
