"""`python -m validation.exports [--to newton] [BAND...]`: reports/validation/export-<target>.json.

Each band that a run has identified is exported to MuJoCo or Newton and replayed there, on the CPU
(Newton also on the GPU that SLING_DEVICE names: export-newton-gpu.json); or to PhysX, on a GPU. The
report is written anew after each band, so that one that was killed has those before.
"""

from __future__ import annotations

import argparse
import tempfile
from importlib.metadata import version
from pathlib import Path

from pipeline.band_folder import identified
from pipeline.params import load
from sling2sim2real.base import errors
from sling2sim2real.base.errors import UserError
from sling2sim2real.base.machine import device
from sling2sim2real.exporting.card import ASKED
from sling2sim2real.exporting.export import export
from validation.reports import write_report

REPORT = "reports/validation/export-{}.json"
TARGETS = {  # packages (Newton's match is MuJoCo's), and the command's arguments
    "mjcf": (("mujoco",), ""),
    "newton": (("newton", "mujoco"), "--to newton"),
    "usd": ((), "--to usd band1-dips band2-dips band3-dips"),
}
KEPT = "met engine proof matched time_step_s time_step_error springs_error match on_paper"
KEPT = (*KEPT.split(), "factor_on_youngs_modulus", "factor_on_mass", "factor_on_rest_length")


def main() -> None:
    """Export, replay, write. Raises UserError."""
    parser = argparse.ArgumentParser(prog="python -m validation.exports")
    parser.add_argument("--to", choices=TARGETS, default="mjcf")
    parser.add_argument("bands", nargs="*", metavar="RECORDING")
    args, cards = parser.parse_args(), {}
    target, (packages, arguments) = args.to, TARGETS[args.to]
    place = {"mjcf": "cpu", "newton": device(), "usd": "cuda:0"}[target]
    name = f"{target}-gpu" if target == "newton" and place != "cpu" else target
    path, bands = Path(REPORT.format(name)), args.bands or list(load().run.first)
    versions = {name: version(name) for name in packages}
    for band in bands:
        card = exported(target, band)
        cards[band] = {name: card[name] for name in KEPT if name in card}
        print(f"{band}: {'met' if card['met'] else 'NOT met'}", flush=True)
        content = {
            "asked": ASKED,
            "met": len(cards) == len(bands) and all(row["met"] for row in cards.values()),
            "bands": cards,
        }
        write_report(path, content, arguments, device=place, versions=versions)


def exported(target: str, band: str) -> dict:
    """The card of a recording's band, exported and replayed. Raises UserError."""
    with tempfile.TemporaryDirectory() as folder:
        run = load().run
        if band not in run.recordings:
            raise UserError(f"{band}: params.yaml records {', '.join(run.recordings)}")
        pair = run.pairs[f"{band}-{run.main}"]
        model = identified(pair)
        card = export(model, target, folder).card
    if "met" not in card:
        raise UserError(f"{target}: its engine or a GPU is missing; nothing was launched there")
    return card


if __name__ == "__main__":
    errors.run(main)
