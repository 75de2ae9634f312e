"""`python -m validation.exports [--to newton] [BAND...]`: reports/validation/export-<target>.json.

Each band that a run has identified is exported to MuJoCo or Newton and replayed there, on the CPU;
or to PhysX, on a GPU.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from importlib.metadata import version
from pathlib import Path

from pipeline.base.environment import environment
from pipeline.base.errors import UserError
from pipeline.base.files import write_json
from pipeline.base.layout import Layout
from pipeline.episode.episode import Episode
from pipeline.export.card import ASKED
from pipeline.params import load
from sling2sim2real.exporting import export
from sling2sim2real.identification import Identification

REPORTS = Path("reports/validation")
PACKAGES = {
    "mjcf": ("mujoco",),
    "newton": ("newton", "mujoco"),
    "usd": (),
}  # Newton's match: MuJoCo's
COMMANDS = {
    "mjcf": "python -m validation.exports",
    "newton": "python -m validation.exports --to newton",
    "usd": "python -m validation.exports --to usd band1_dip band2_dip band3_dip",
}
KEPT = (
    "met",
    "engine",
    "proof",
    "matched",
    "time_step_s",
    "time_step_error",
    "springs_error",
    "pull",
    "match",
    "on_paper",
    "factor_on_youngs_modulus",
    "factor_on_mass",
)
DEVICES = {"usd": "cuda:0"}  # else the CPU


def main(target: str, bands: list[str]) -> None:
    """Export, replay, write. Raises UserError."""
    params, cards = load(), {}
    for band in bands or params.run.bands:
        with tempfile.TemporaryDirectory() as folder:
            model = Identification.of_run(band, params.run.methods[0])
            episode = Episode.load_all(Layout().episodes(band))[0]
            card = export(model, target, folder, episode=episode).card
        if "met" not in card:
            raise UserError(f"{target}: its engine or a GPU is missing; nothing was launched there")
        cards[band] = {name: card[name] for name in KEPT if name in card}
        print(f"{band}: {'met' if card['met'] else 'NOT met'}", flush=True)
    provenance = environment(DEVICES.get(target, "cpu"), COMMANDS[target])
    provenance["versions"] |= {name: version(name) for name in PACKAGES[target]}
    met = all(card["met"] for card in cards.values())
    report = REPORTS / f"export-{target}.json"
    write_json(report, {"asked": ASKED, "met": met, "bands": cards, **provenance})


if __name__ == "__main__":
    parser = argparse.ArgumentParser(prog="python -m validation.exports")
    parser.add_argument("--to", choices=COMMANDS, default="mjcf")
    parser.add_argument("bands", nargs="*", metavar="BAND")
    arguments = parser.parse_args()
    try:
        main(arguments.to, arguments.bands)
    except UserError as error:
        sys.exit(f"error: {error}")
