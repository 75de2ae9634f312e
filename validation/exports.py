"""`python -m validation.exports [--to newton] [BAND...]`: reports/validation/export-<target>.json.

Each band that a run has identified is exported to MuJoCo or Newton and replayed there, on the CPU
(Newton also on the GPU that SLING_DEVICE names: export-newton-gpu.json); or to PhysX, on a GPU. On
several GPUs each has a band of its own. The report is written anew after each band, so that one
that was killed has those before.
"""

from __future__ import annotations

import argparse
import os
import tempfile
from collections.abc import Iterator
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from importlib.metadata import version
from multiprocessing import get_context
from pathlib import Path

from pipeline.base import errors
from pipeline.base.errors import UserError
from pipeline.base.layout import Layout
from pipeline.base.machine import devices, gpus
from pipeline.episode.episode import Episode
from pipeline.export.card import ASKED
from pipeline.params import load
from sling2sim2real.exporting import export
from sling2sim2real.identification import Identification
from validation.reports import write_report

REPORT = "reports/validation/export-{}.json"
TARGETS = {  # packages (Newton's match is MuJoCo's), and the command's arguments
    "mjcf": (("mujoco",), ""),
    "newton": (("newton", "mujoco"), "--to newton"),
    "usd": ((), "--to usd band1_dip band2_dip band3_dip"),
}
KEPT = "met engine proof matched time_step_s time_step_error springs_error pull match on_paper"
KEPT = (*KEPT.split(), "factor_on_youngs_modulus", "factor_on_mass", "factor_on_rest_length")


def main() -> None:
    """Export, replay, write. Raises UserError."""
    parser = argparse.ArgumentParser(prog="python -m validation.exports")
    parser.add_argument("--to", choices=TARGETS, default="mjcf")
    parser.add_argument("bands", nargs="*", metavar="BAND")
    args, cards = parser.parse_args(), {}
    target, (packages, arguments) = args.to, TARGETS[args.to]
    device = {"mjcf": "cpu", "newton": devices()[0], "usd": "cuda:0"}[target]
    name = f"{target}-gpu" if target == "newton" and device != "cpu" else target
    path, bands = Path(REPORT.format(name)), args.bands or list(load().run.bands)
    versions = {name: version(name) for name in packages}
    for band, card in _cards(target, bands, device):
        cards[band] = {name: card[name] for name in KEPT if name in card}
        print(f"{band}: {'met' if card['met'] else 'NOT met'}", flush=True)
        content = {
            "asked": ASKED,
            "met": len(cards) == len(bands) and all(row["met"] for row in cards.values()),
            "bands": {name: cards[name] for name in bands if name in cards},
        }
        write_report(path, content, arguments, device=device, versions=versions)


def _cards(target: str, bands: list[str], device: str) -> Iterator[tuple[str, dict]]:
    """Export the bands, on all GPUs; a band and its card, as soon as it is made."""
    places = [0] if device == "cpu" else list(range(len(gpus())))
    if target == "newton" and device != "cpu":
        places *= len(bands)  # its steps are short: they wait for Python, not for the GPU
    places = places[: len(bands)]
    if len(places) < 2:
        yield from ((band, exported(target, band)) for band in bands)
        return
    context = get_context("spawn")
    free = context.Queue()
    for number in places:
        free.put(number)
    with ProcessPoolExecutor(len(places), context, initializer=_take_gpu, initargs=(free,)) as pool:
        started = {pool.submit(exported, target, band): band for band in bands}
        ended = list[Future]()
        for done in as_completed(started):
            ended.append(done)
            if done.exception() is None:
                yield started[done], done.result()
    for done in ended:
        done.result()  # raises what a band failed of, after the others


def _take_gpu(free) -> None:
    """Leave this process one GPU alone, which PhysX then takes for the first."""
    seen = os.environ.get("CUDA_VISIBLE_DEVICES")
    number = free.get()
    os.environ["CUDA_VISIBLE_DEVICES"] = seen.split(",")[number] if seen else str(number)
    if os.environ.get("SLING_DEVICE", "cpu") != "cpu":
        os.environ["SLING_DEVICE"] = "cuda"  # its name among those that this process sees


def exported(target: str, band: str) -> dict:
    """The card of a band that is exported and replayed. Raises UserError."""
    with tempfile.TemporaryDirectory() as folder:
        model = Identification.of_run(band, load().run.methods[0])
        episode = Episode.load_all(Layout().episodes(band))[0]
        card = export(model, target, folder, episode=episode).card
    if "met" not in card:
        raise UserError(f"{target}: its engine or a GPU is missing; nothing was launched there")
    return card


if __name__ == "__main__":
    errors.run(main)
