"""How far processors and GPUs round apart: the same episodes identified and launched on several.

    python -m validation.campaigns.machines --device cuda:0 --report NAME.json
    python -m validation.campaigns.machines --compare reports/validation/machines/*.json
    python -m validation.campaigns.machines --twice RUN OTHER

The first identifies each band, by our method and by the paper's, from what a run has left under
data/episodes and data/clamps, and launches fixed draws in the simulator. A GPU has the rollouts
of searches, and the launches; the fit of least squares is on the CPU anywhere. The second prints
how far machines differ, and fails where our landings do by more than 0.2 %; of the paper's method,
whose search takes another way after the first other bit, it only tells. The third compares what
two runs of one machine wrote, byte by byte, with the committed one, of another, beside them. It
writes reports/validation/twice.json.
"""

from __future__ import annotations

import os
import time
from collections.abc import Sequence
from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd
from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from pipeline.base import errors
from pipeline.base.errors import UserError, one_line
from pipeline.base.fingerprint import fingerprint
from pipeline.base.layout import Layout, made
from pipeline.base.machine import named, processor
from pipeline.base.pool import Pool
from pipeline.base.schema import JsonRecord, read_json
from pipeline.episode.episode import Episode
from pipeline.identify.objective.loss import EpisodeLoss
from pipeline.identify.results.mounting import sling_of_method
from pipeline.params import Params, expect_known, load
from pipeline.simulator.interaction import interact
from pipeline.simulator.launch import launch
from validation.campaigns import runner
from validation.campaigns.runner import OURS, PAPER
from validation.density import calibrated_by
from validation.marked import row
from validation.reports import plain, write_report

FOLDER, TWICE = Path("reports/validation/machines"), Path("reports/validation/twice.json")
COMMITTED, TABLE = Path(), Path("reports/tables/table1.csv")
DRAWS = [*product((-0.36, -0.31, -0.27), (-0.20, -0.15, -0.11))]  # (y, z) [m], all in the box
LIMIT = 2e-3  # of a landing of ours, relative
ALONE = "OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"  # one each, as stages have


class MachineLandings(JsonRecord):
    """What a method found in a band on a machine; None where a launch fails."""

    theta: dict[str, float]
    loss: float | None
    landing: list[float | None]
    seconds: float


class MachineReport(JsonRecord):
    """The part of a machine's JSON that is compared."""

    processor: str
    device: str
    device_name: str
    inputs: dict[str, str]
    code: dict[str, str | None]
    draws: list[list[float]]
    bands: dict[str, dict[str, MachineLandings]]


def inputs(params: Params, band: str, root: Path) -> str:
    """A digest of all that a band's identification depends on but the code. Raises NotMade."""
    layout = Layout(root)
    names = ("signals", "clouds")
    files = [layout.episode(band) / f"{name}.parquet" for name in names]
    settings = (params.bands[band], params.setup, params.sling, params.force, params.loss)
    settings += (params.parameters, params.optimizer, params.methods[OURS], params.methods[PAPER])
    texts = [section.model_dump_json() for section in settings]
    return fingerprint(*map(made, [*files, layout.clamps(band)]), *texts)


def identified(band: str, method: str, root: Path, device: str) -> dict:
    """θ of a band, its loss, and where DRAWS land with it [m], as JSON has them."""
    params = load(root / "params.yaml")
    devices, start = named(device, "--device"), time.perf_counter()
    sling = sling_of_method(params, band, method, root)
    episode = Episode.load(Layout(root).episode(band))
    outcome, _ = calibrated_by(params, method, sling, [episode], devices=devices)
    seconds = time.perf_counter() - start
    loss = EpisodeLoss.of(params, method, episode, sling)
    terms = loss.terms(interact(sling, episode, outcome.theta, device=devices[0], fetch=False))
    landed = launch(sling, outcome.setup, outcome.theta, np.array(DRAWS), device=devices)
    return plain(
        {
            "theta": outcome.identified,
            "loss": loss.total(terms)[0],
            "landing": landed.landing_y,
            "failure": landed.failure,
            "seconds": seconds,
        }
    )


def measure(bands: Sequence[str], root: Path, device: str) -> dict:
    """What a machine's JSON holds of a project, but what `environment` adds. Raises UserError."""
    params = load(root / "params.yaml")
    bands = bands or params.run.bands
    for band in bands:
        expect_known(params, "band", band)
    digests = {band: inputs(params, band, root) for band in bands}
    for name in ALONE:
        os.environ[name] = "1"  # of the process that is started from here
    content = {band: {} for band in bands}
    with Pool(workers=1) as pool:
        for band, method in product(bands, (OURS, PAPER)):
            done = pool.submit(identified, band, method, root, device).result()
            content[band][method] = done
            print(f"{band} {method}: loss {done['loss']}, {done['seconds']:.0f} s", flush=True)
    return {
        "kind": "virtual",
        "asked": "How far processors and GPUs round apart: parameters identified from the same"
        " episodes, and launches of the same draws.",
        "processor": processor(),
        "inputs": digests,
        "draws": DRAWS,
        "bands": content,
    }


def compared(reports: dict[str, MachineReport]) -> tuple[list[str], bool]:
    """A table of machines by name, and whether our landings differ by at most LIMIT.

    Raises UserError where they are not of the same inputs, draws and code.
    """
    if len(reports) < 2:
        raise UserError(f"{', '.join(reports) or 'nothing'}: two machines at least are compared")
    first, *others = reports
    for other, what in product(others, ("inputs", "draws", "code")):
        if _comparable(reports[first], what) != _comparable(reports[other], what):
            raise UserError(f"{first} and {other}: of different {what}, which nobody can compare")
    lines = ["| machine | processor | device |", "|---|---|---|"]
    lines += [row(n, report.processor, report.device_name) for n, report in reports.items()]
    lines += ["", "| band | method | machine | E [kPa] | loss | landings, off the first | time |"]
    lines += ["|---|---|---|---:|---:|---:|---:|"]
    bands, largest = reports[first].bands, dict.fromkeys((OURS, PAPER), 0.0)
    for band, method, name in product(bands, largest, reports):
        result, reference = (reports[n].bands[band][method] for n in (name, first))
        lines.append(
            f"| {band} | {method} | {name} | {result.theta['youngs_modulus'] / 1e3:.3f} |"
            f" {result.loss or np.nan:.6f} | {100 * apart([reference, result]):.2g} % |"
            f" {result.seconds:.0f} s |"
        )
    for band, method in product(bands, largest):
        summary = [report.bands[band][method] for report in reports.values()]
        largest[method] = max(largest[method], apart(summary))
    met = largest[OURS] <= LIMIT
    lines += ["", f"{OURS}: landings of any two differ by {100 * largest[OURS]:.2g} % at most;"]
    lines[-1] += f" {'within' if met else 'MORE than'} {100 * LIMIT:g} %"
    lines += [f"{PAPER}: by {100 * largest[PAPER]:.2g} % at most; nothing is asked of it"]
    return lines, met


def apart(summary: list[MachineLandings]) -> float:
    """The largest relative difference of a landing; infinite where only some machines have it."""
    landings = np.array([machine.landing for machine in summary], float)  # None is NaN
    lacks = np.isnan(landings)
    if (lacks.any(axis=0) != lacks.all(axis=0)).any():
        return np.inf
    there = landings[:, ~lacks.any(axis=0)]
    low, high = there.min(axis=0), there.max(axis=0)
    return float((high / low - 1).max(initial=0.0))


def _comparable(report: MachineReport, what: str) -> object:
    """Value to compare; of the code, pipeline/ without what it prints, stores and starts by."""
    value = getattr(report, what)
    if what != "code":
        return value
    return {
        part: digest
        for part, digest in value.items()
        if part.startswith("pipeline/") and part != "pipeline/base"
    }


def outputs(lock: Path) -> dict[str, str]:
    """The digest of every output of a run, by its path, as its dvc.lock has it."""
    try:
        stages = YAML(typ="safe").load(lock.read_text(encoding="utf-8"))["stages"].values()
        return {out["path"]: out["md5"] for stage in stages for out in stage.get("outs", ())}
    except (OSError, ValueError, YAMLError, KeyError, TypeError, AttributeError) as error:
        raise UserError(f"{lock}: no dvc.lock of a run: {one_line(error)}") from error


def landings(folder: Path) -> dict[tuple[str, str], float]:
    """Mean distance from all targets [cm], by band and method; nothing where no launch landed."""
    table = pd.read_csv(made(folder / TABLE))
    rows = table[(table.source == "virtual") & (table.target_m == "all")]
    means = rows.set_index(["band", "method"])["mean_error_cm"]
    return pd.to_numeric(means, errors="coerce").dropna().to_dict()


def twice(run: Path, other: Path) -> dict:
    """What two runs of one machine wrote, byte by byte, and how far the committed run is off.

    Args:
        run, other: Folders of clones in which everything has run, in `other` perhaps more.
    """
    first, second = (outputs(folder / "dvc.lock") for folder in (run, other))
    differing = sorted(path for path, digest in first.items() if second.get(path) != digest)
    committed = landings(COMMITTED)
    return {
        "kind": "virtual",
        "asked": "Two runs of one machine write the same bytes.",
        "met": not differing,
        "outputs": len(first),
        "differing": differing,
        "landings_cm": {
            f"{band} {method}": {"these_runs": value, "committed": committed.get((band, method))}
            for (band, method), value in landings(run).items()
        },
    }


def main() -> int:
    parser = runner.parser(__doc__, None)
    what = parser.add_mutually_exclusive_group()
    what.add_argument("--compare", type=Path, nargs="+", metavar="JSON", help="of machines")
    what.add_argument("--twice", type=Path, nargs=2, metavar="RUN", help="folders of whole runs")
    parser.add_argument("--project", type=Path, default=Path(), help="folder (default: this)")
    parser.add_argument("--device", default="cpu", help="cpu (default) or cuda:0")
    parser.add_argument("--bands", nargs="+", default=(), help="(default: those that run)")
    args = parser.parse_args()
    if args.compare:
        reports = {path.stem: read_json(path, MachineReport) for path in args.compare}
        lines, met = compared(reports)
        print(*lines, sep="\n")
        return 0 if met else 1
    if args.twice:
        content = write_report(args.report or TWICE, twice(*args.twice), "--twice RUN OTHER")
        differing = content["differing"]
        print(*differing, f"{len(differing)} of {content['outputs']} outputs differ", sep="\n")
        return 1 if differing else 0
    if not args.report:
        raise UserError("--report FILE, --compare JSON JSON or --twice RUN OTHER is wanted")
    content = measure(args.bands, args.project, args.device)
    arguments = f"--device {args.device} --report {FOLDER / args.report.name}"
    write_report(args.report, content, arguments, device=args.device)
    print(args.report)
    return 0


if __name__ == "__main__":
    errors.run(main)
