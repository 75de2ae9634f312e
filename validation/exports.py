"""`python -m validation.exports [--to newton] [BAND...]`: reports/validation/export-<target>.json.

Each band that a run has identified is exported to MuJoCo or Newton and replayed there, on the CPU;
or to PhysX, on a GPU.
"""

from __future__ import annotations

import argparse
import tempfile
from importlib.metadata import version
from pathlib import Path

from pipeline.base import errors
from pipeline.base.errors import UserError
from pipeline.base.layout import Layout
from pipeline.episode.episode import Episode
from pipeline.export.card import ASKED
from pipeline.params import load
from sling2sim2real.exporting import export
from sling2sim2real.identification import Identification
from validation.reports import write_report

REPORT = "reports/validation/export-{}.json"
TARGETS = {  # device, packages (Newton's match is MuJoCo's), and the command's arguments
    "mjcf": ("cpu", ("mujoco",), ""),
    "newton": ("cpu", ("newton", "mujoco"), "--to newton"),
    "usd": ("cuda:0", (), "--to usd band1_dip band2_dip band3_dip"),
}
KEPT = "met engine proof matched time_step_s time_step_error springs_error pull match on_paper"
KEPT = (*KEPT.split(), "factor_on_youngs_modulus", "factor_on_mass")


def main() -> None:
    """Export, replay, write. Raises UserError."""
    parser = argparse.ArgumentParser(prog="python -m validation.exports")
    parser.add_argument("--to", choices=TARGETS, default="mjcf")
    parser.add_argument("bands", nargs="*", metavar="BAND")
    args, params, cards = parser.parse_args(), load(), {}
    target, (device, packages, arguments) = args.to, TARGETS[args.to]
    for band in args.bands or params.run.bands:
        with tempfile.TemporaryDirectory() as folder:
            model = Identification.of_run(band, params.run.methods[0])
            episode = Episode.load_all(Layout().episodes(band))[0]
            card = export(model, target, folder, episode=episode).card
        if "met" not in card:
            raise UserError(f"{target}: its engine or a GPU is missing; nothing was launched there")
        cards[band] = {name: card[name] for name in KEPT if name in card}
        print(f"{band}: {'met' if card['met'] else 'NOT met'}", flush=True)
    met = all(card["met"] for card in cards.values())
    versions = {name: version(name) for name in packages}
    content = {"asked": ASKED, "met": met, "bands": cards}
    path = Path(REPORT.format(target))
    write_report(path, content, arguments, device=device, versions=versions)


if __name__ == "__main__":
    errors.run(main)
