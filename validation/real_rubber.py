"""The law `rubber` against published measurements of real rubber.

    python -m validation.real_rubber --data ../shared/data/real

writes reports/validation/real-rubber.json and the figures of docs/real.md. The measurements stay
where they are: no file of theirs goes into the project.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

from sling2sim2real.base import errors
from sling2sim2real.base.errors import UserError
from sling2sim2real.settings.identification import LAWS
from sling2sim2real.simulator.rubber import RUBBER
from validation.campaigns import runner
from validation.real import data, figures, fits
from validation.reports import plain, write_report

REPORT = Path("reports/validation/real-rubber.json")
FIGURES = Path("docs/real")
TOPS = 1.66, 1.85, 2.5  # stretches up to which silicones are fitted
FIRST, LONG = (300.0, 3000.0), 86_400.0  # s
SOURCES = {
    "srmd_silicones": "Marechal et al., Soft Robotics 2021 (LucMarechal/Soft-Robotics-Materials-"
    "Database, commit 8ff66c3)",
    "rubber_multiaxial": "Treloar 1944, Jones and Treloar 1975, James et al. 1975, Kawabata 1981,"
    " Kawamura 2001, Meunier 2008 (Chongran-Zhao/Calibration-Hyperelasticity, commit 1df0f5d)",
    "latex_relaxation_24h": "Guseinov et al., Nature Communications 2020"
    " (russelmann/temporal-morphing-ncomms, commit d735547)",
    "vhb4910": "Chongran-Zhao/VHB4910_data, commit a23efd8",
}


def silicones(folder: Path) -> dict:
    """Fits of each specimen up to each of TOPS."""
    specimens = {}
    for whole in data.silicones(folder):
        rows = {}
        for top in TOPS:
            curve = whole.up_to(top, data.SLACK)
            fit = fits.shape_of(curve, fits.MOST_SLACK)
            noise = {"rms_percent": fit.rms, "noise_percent": fits.noise_of(curve)}
            rows[f"{top:g}"] = plain(noise | fit.values, 4)
        specimens[whole.name] = rows
    return specimens


def silicones_summary(specimens: dict) -> dict:
    """Medians and worst ones, and who is off by more than 2 % and 1.3 times its noise."""
    result = {}
    for top in map("{:g}".format, TOPS):
        rms = {name: rows[top]["rms_percent"] for name, rows in specimens.items()}
        noise = {name: rows[top]["noise_percent"] for name, rows in specimens.items()}
        result[top] = {
            "median_rms_percent": float(np.median([*rms.values()])),
            "worst": max(rms, key=lambda name: rms[name]),
            "worst_rms_percent": max(rms.values()),
            "beyond_2_percent_and_noise": [
                name for name in rms if rms[name] > 2 and rms[name] > 1.3 * noise[name]
            ],
        }
    return result


def multiaxial(folder: Path) -> dict:
    """Shape from the uniaxial mode up to a stretch of 2.5; what it predicts of the others."""
    sources = {}
    for source, modes in data.multiaxial(folder).items():
        rows = modes["UT"]
        rows = rows[(rows[:, 0] >= 1) & (rows[:, 0] <= 2.5)]
        fit = fits.shape_of(data.Curve(source, rows[:, 0], rows[:, 3]))
        shape = fit.values["mooney_share"], fit.values["upturn"]
        predicted = {}
        for mode, values in modes.items():
            small = values[(values[:, :3].max(1) <= 2.5) & (values[:, :3].min(1) >= 0.16)]
            if mode == "UT" or len(small) < 3:
                continue
            summary = fit.values["shear_modulus"] * fits.biaxial(small, shape)
            measured = small[:, 3:]
            off = (summary - measured)[np.isfinite(measured)]
            peak = np.nanmax(np.abs(measured))
            predicted[mode] = float(f"{100 * np.sqrt(np.mean(off**2)) / peak:.3g}")
        sources[source] = {
            "uniaxial_points": len(rows),
            "uniaxial_rms_percent": float(f"{fit.rms:.3g}"),
            "values": plain(fit.values, 4),
            "predicted_rms_percent": predicted,
        }
    return sources


def latex(folder: Path) -> dict:
    """One weight for a ramp and a day; forecasts of the day from its beginning."""
    time, place, load = data.latex(folder)
    chosen = np.unique(np.append(np.arange(80), np.geomspace(80, len(time) - 1, 400).astype(int)))
    t, x, f = time[chosen], place[chosen], load[chosen]
    begin, end = np.argmax(load > 0.1), load.max()
    reach = LAWS[RUBBER]

    def pull(q: np.ndarray) -> np.ndarray:
        strength, share, upturn, relaxation, length, zero = q
        stretch = np.maximum(1 + (x - zero) / length, 1.0)
        values = {"mooney_share": share, "upturn": upturn, "softening": 0.0}
        return strength * fits.history(stretch, t, values | {"relaxation": relaxation})

    def fit(until: float) -> np.ndarray:
        seen = t <= until

        def left(q: np.ndarray) -> np.ndarray:
            gauge = np.log(q[4] / 25.0)  # of a strip whose length the file does not tell
            return np.append((pull(q) - f)[seen] / end, [gauge, (q[2] - 0.05) / 0.05])

        low = [0.01, *(reach[name][0] for name in ("mooney_share", "upturn", "relaxation"))]
        high = [100.0, *(reach[name][1] for name in ("mooney_share", "upturn", "relaxation"))]
        zero = place[begin]
        start = [2.0, 0.3, 0.03, 0.03, 25.0, zero]
        bounds = [*low, 5.0, zero - 2], [*high, 100.0, zero + 1]
        return least_squares(left, start, bounds=bounds).x

    def miss(q: np.ndarray) -> dict[str, float]:
        off = 100 * (pull(q) - f) / end
        even = np.interp(time, t, off)
        return {
            "rms_percent": float(np.sqrt(np.mean(even**2))),
            "rms_percent_even_in_log_time": float(np.sqrt(np.mean(off**2))),
            "worst_percent": float(np.abs(off).max()),
            "at_the_end_percent": float(off[-1]),
            "relaxation_per_decade": float(q[3]),
        }

    misses = {"whole": miss(fit(LONG * 2))}
    misses |= {f"forecast_from_{until:g}_s": miss(fit(until)) for until in FIRST}
    return plain(misses, 4)


def acrylic(folder: Path) -> dict:
    """Cycles at three rates and holds up to a stretch of 2.5: with and without softening."""
    curves = [curve for curve in data.acrylic(folder) if curve.stretch.max() <= 2.51]
    result = {}
    for name, free in {
        "all": fits.NAMES,
        "without softening": ("mooney_share", "upturn", "relaxation"),
    }.items():
        done = fits.memory_of(curves, free)
        result[name] = {
            "rms_percent": float(f"{np.sqrt(np.mean([fit.rms**2 for fit in done])):.3g}"),
            "values": plain(done[0].values, 4),
            "by_history": {
                c.name: float(f"{fit.rms:.3g}") for c, fit in zip(curves, done, strict=True)
            },
        }
    return result


def main() -> None:
    parser = runner.parser(__doc__, REPORT)
    parser.add_argument("--data", type=Path, required=True, help="folder of the measurements")
    args = parser.parse_args()
    missing = [name for name in SOURCES if not (args.data / name).is_dir()]
    if missing:
        raise UserError(f"--data {args.data}: has no folder {missing[0]}")
    each = silicones(args.data)
    content = {
        "kind": "measured by others, quasi-static",
        "asked": "Does the law `rubber` have the shape, the relaxation and the hysteresis of real"
        " rubber?",
        "sources": SOURCES,
        "silicones": {"summary": silicones_summary(each), "specimens": each},
        "multiaxial": multiaxial(args.data),
        "latex": latex(args.data),
        "vhb4910": acrylic(args.data),
    }
    figures.draw(FIGURES, args.data, content)
    write_report(args.report, content, "--data ../shared/data/real")
    print(f"wrote {args.report} and {FIGURES}/")


if __name__ == "__main__":
    errors.run(main)
