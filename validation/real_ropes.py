"""The rod's slack swing against motion capture of real ropes.

    python -m validation.real_ropes --data ../shared/data/real

Of each rope, three numbers are fitted to the beginning of one run, and another run is predicted
from its first frame and its ends alone. Writes reports/validation/real-ropes.json and the figure of
docs/real.md. The measurements stay where they are: no file of theirs goes into the project.
"""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np

from pipeline.base import errors
from pipeline.base.errors import UserError
from pipeline.base.machine import cores
from pipeline.params import load
from pipeline.params.identification import SlingParams
from validation.campaigns import runner
from validation.projects import DEFAULTS
from validation.real import data, figures
from validation.real.ropes import NAMES, RATE, chords_of, fitted, inner, swing
from validation.reports import write_report

REPORT = Path("reports/validation/real-ropes.json")
FIGURES = Path("docs/real")
FITTED = 200  # frames of the first run
SOURCE = (
    "Chen et al., Differentiable Discrete Elastic Rods for Real-Time Modeling of Deformable Linear"
    " Objects, CoRL 2024, arXiv:2406.05931 (roahmlab/DEFORM, commit b73b8b8, data_set/DLO*/eval)"
)
# Mean size of a coordinate's error [mm], all markers, over 14 runs of 5 s: at the start of its
# training and the least in it. It learns from 56 runs. Of DLO5 the repository has none.
DEFORM = {"DLO1": (26.1, 11.1), "DLO2": (29.7, 10.2), "DLO3": (28.3, 9.9), "DLO4": (38.8, 11.5)}
DEFORM_SOURCE = "roahmlab/DEFORM, commit b73b8b8, loss_record/eval_loss_DLO*.pkl, first and least"


def rms(gaps: np.ndarray, axis=None) -> np.ndarray:
    """Root mean square of distances [mm] of gaps (T, M, 3) [m]."""
    return 1e3 * np.sqrt((gaps**2).sum(2).mean(axis))


def missed(run: np.ndarray, summary: np.ndarray) -> dict:
    """How far markers (T, M, 3) [m] are from measured ones."""
    gaps, second = inner(summary) - inner(run), int(RATE)
    return {
        "rms_mm": round(float(rms(gaps)), 1),
        "by_marker_mm": rms(gaps, 0).round(1).tolist(),
        "by_second_mm": [
            round(float(rms(gaps[i : i + second])), 1) for i in range(0, len(run), second)
        ],
        "mean_coordinate_mm": round(float(1e3 * np.abs(summary - run).mean()), 1),
    }


def carried(run: np.ndarray) -> np.ndarray:
    """No rope at all: the first frame's shape goes along with the mean of the ends."""
    return run[0] + (run[:, [0, -1]] - run[0, [0, -1]]).mean(1)[:, None]


def measured(first: np.ndarray, second: np.ndarray, size: SlingParams) -> tuple[dict, np.ndarray]:
    """What one rope's report says, and the prediction of its second run."""
    chords = chords_of([first])
    values = fitted(first[:FITTED], chords, size)
    again, summary = (swing(run, chords, values, size) for run in (first, second))
    return {
        "length_m": round(float(chords.sum()), 3),
        "values": {name: float(f"{values[name]:.3g}") for name in NAMES},
        "fitted_run": missed(first, again),
        "predicted_run": missed(second, summary),
        "first_shape_carried_along_rms_mm": round(float(rms(inner(carried(second) - second))), 1),
    }, summary


def finer(run: np.ndarray, rope: dict, size: SlingParams, chords: np.ndarray) -> float:
    """Change of a prediction by edges and steps of half the length, rms [mm]."""
    coarse, fine = (swing(run, chords, rope["values"], size, parts=n, refine=n) for n in (1, 2))
    return round(float(rms(inner(fine - coarse))), 1)


def main() -> None:
    parser = runner.parser(__doc__, REPORT)
    parser.add_argument("--data", type=Path, required=True, help="folder of the measurements")
    args = parser.parse_args()
    runs = data.ropes(args.data)
    if not runs or any(len(two) < 2 for two in runs.values()):
        raise UserError(f"--data {args.data}: deform_dlo_mocap needs two runs of each rope")
    size, ropes, summary = load(DEFAULTS).sling, {}, {}
    with ProcessPoolExecutor(min(cores(), len(runs))) as pool:
        tasks = {name: pool.submit(measured, two[0], two[1], size) for name, two in runs.items()}
    for name, task in tasks.items():
        ropes[name], summary[name] = task.result()
        print(f"{name}: {ropes[name]['predicted_run']['rms_mm']} mm rms", flush=True)
        if name in DEFORM:
            start, least = DEFORM[name]
            ropes[name]["deform_mean_coordinate_mm"] = {"at_the_start": start, "least": least}
    rope = min(runs)
    content = {
        "kind": "measured by others, slack swing",
        "asked": "Does the rod swing as real ropes do: three numbers fitted to one run, another"
        " predicted?",
        "sources": {"deform_dlo_mocap": SOURCE, "deform": DEFORM_SOURCE},
        "fitted_s": FITTED / RATE,
        "values_are": "bending length [m], damping time of bending [s], drag over mass and speed"
        " [1/s]",
        "finer": {rope: finer(runs[rope][1], ropes[rope], size, chords_of(runs[rope][:1]))},
        "ropes": ropes,
    }
    figures.draw_ropes(FIGURES, {name: two[1] for name, two in runs.items()}, summary, content)
    write_report(args.report, content, "--data ../shared/data/real")
    print(f"wrote {args.report} and {FIGURES}/ropes.png")


if __name__ == "__main__":
    errors.run(main)
