"""The rod against measured launches of slingshots: what a few pellets tell of the others.

    python -m validation.real_launches --data ../shared/data/real

writes reports/validation/real-launches.json, which docs/real.md cites. The measurements stay where
they are: no file of theirs goes into the project.

Each band has two numbers: its modulus and its moving mass, which is that of band and pouch. All
bands share one damping. The usual formula, v^2 = 2 W/(m + m_e), has two numbers a band too: energy
and effective mass.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.optimize import least_squares

from pipeline import params as settings
from sling2sim2real.base import errors
from sling2sim2real.base.errors import UserError
from sling2sim2real.simulator import ClampedBand, Launches, LaunchSetup, Parameters, launch
from sling2sim2real.simulator.model import GRAVITY
from validation.campaigns import runner
from validation.reports import plain, write_report

REPORT = Path("reports/validation/real-launches.json")
FILE = Path("slingshot_launches/launches.csv")
SOURCE = (
    "educatedCaveman/SS-BAM (Sling-Shot Band Ammo Matching), `SS-BAM - data.csv`, commit"
    " 728993c92eefe85fdfdf5a3c65ef09a2f27d8224"
)
SIZES = {  # thickness, narrowest, widest [mm] of one band, as the source's README has them
    "band_A": (0.4, 8, 12),
    "band_B": (0.5, 12, 18),
    "band_C": (0.6, 12, 18),
    "band_D": (0.7, 18, 22),
    "band_E": (0.7, 25, 30),
    "band_F": (0.7, 16, 21),
}
LENGTH, LATEX = 0.270, 950.0  # m of one band; kg/m^3
HALF_FORK = 0.04  # m; the source does not tell it
THIN = 1e-7  # N m^2, about the flexural rigidity of such a strip
POISSON = 0.49
START = 1.3e6  # Pa
DAMPINGS = np.geomspace(0.3e-3, 3e-3, 13)  # s
FINER = 4  # times shorter steps and edges, as a check
Split = Callable[[int], np.ndarray]
SPLITS: dict[str, Split] = {  # which of n pellets, from light to heavy, are fitted
    "all": lambda n: np.full(n, True),
    "every third": lambda n: np.arange(n) % 3 == 0,
    "lightest, middle, heaviest": lambda n: np.isin(np.arange(n), (0, n // 2, n - 1)),
    "heavier half": lambda n: np.arange(n) >= n // 2,
    "lighter half": lambda n: np.arange(n) < n // 2,
}


@dataclass(frozen=True)
class Slingshot:
    """What was measured of a band.

    Attributes:
        draw, slack: From the fork to the projectile, drawn and just taut [m].
        weight: That holds it drawn [N].
        mass, speed: Of the n pellets, from light to heavy: medians [kg, m/s], shape (n,) each.
        scatter: Standard deviation of a pellet's shots over their median, shape (n,).
        sized_mass: Of both its strips, by their sizes [kg].
        section: Of one strip, by its sizes [m^2].
    """

    name: str
    draw: float
    slack: float
    weight: float
    mass: np.ndarray
    speed: np.ndarray
    scatter: np.ndarray
    sized_mass: float
    section: float


@dataclass(frozen=True)
class Fit:
    """Modulus [Pa] and moving mass [kg] of a band, and what is left of the fitted speeds."""

    modulus: float
    mass: float
    cost: float


def read(file: Path) -> list[Slingshot]:
    """Medians of the shots with each band and pellet."""
    shots = pd.read_csv(file)
    return [slingshot(str(name), of) for name, of in shots.groupby("band_type")]


def slingshot(name: str, shots: pd.DataFrame) -> Slingshot:
    """Medians of the shots with one band."""
    pellets = shots.groupby("pellet_type")
    each = pellets[["calc_mass_g", "velocity_mps"]].median()
    each["scatter"] = pellets.velocity_mps.std() / each.velocity_mps
    each = each.sort_values("calc_mass_g")
    whole = shots[["draw_length_m", "slack_length_m", "draw_weight_kg"]].median()
    thickness, narrowest, widest = SIZES[name]
    section = 1e-6 * thickness * (narrowest + widest) / 2
    return Slingshot(
        name=name,
        draw=whole.draw_length_m,
        slack=whole.slack_length_m,
        weight=GRAVITY * whole.draw_weight_kg,
        mass=1e-3 * each.calc_mass_g.to_numpy(),
        speed=each.velocity_mps.to_numpy(),
        scatter=each.scatter.to_numpy(),
        sized_mass=2 * section * LENGTH * LATEX,
        section=section,
    )


@cache
def _settings() -> settings.Params:
    return settings.load()


def launches(
    band: Slingshot,
    modulus: float,
    mass: float,
    damping: float,
    pellets: np.ndarray,
    finer: int = 1,
) -> Launches:
    """Launch pellets (n,) [kg] level by a rod of a modulus [Pa] and a moving mass [kg].

    The time that damping takes [s] and how the rod is braked are those of the neo-Hookean law.
    """
    params = _settings()
    steps = params.sling.model_copy(update={"edges": finer * params.sling.edges})
    rod = ClampedBand(
        edges=steps.edges,
        rest_length=2 * np.hypot(HALF_FORK, band.slack),
        radius=np.sqrt(band.section / np.pi),
        mass=mass,
        half_width=HALF_FORK,
        clamp_direction=np.array([0.0, -1.0, 0.0]),
        flexural_rigidity=THIN,
        grip_force=params.setup.grip_force,
        finger_opening_time=params.setup.finger_opening_time,
        steps=steps,
    )
    setup = replace(
        LaunchSetup.of(params.setup, steps),
        projectile_mass=pellets, fork_height=5.0, foot_height=0.0, arm_stiffness=None,
    )  # fmt: skip
    theta = Parameters.of(rod.law, np.array([modulus, POISSON, damping, 0.0, 1.0]))
    draws = np.tile([-band.draw, 0.0], (len(pellets), 1))
    return launch(rod, setup, theta, draws, refine=finer)


def off(band: Slingshot, fit: Fit, damping: float, finer: int = 1) -> np.ndarray:
    """Predicted over measured speeds less 1 [%], shape (n,)."""
    done = launches(band, fit.modulus, fit.mass, damping, band.mass, finer)
    return 100 * (done.speed / band.speed - 1)


def fitted(band: Slingshot, damping: float, chosen: np.ndarray) -> Fit:
    """Modulus and moving mass by the speeds of the chosen (n,) pellets."""
    start = np.array([START, band.sized_mass])

    def left(times: np.ndarray) -> np.ndarray:
        modulus, mass = times * start
        speed = launches(band, modulus, mass, damping, band.mass[chosen]).speed
        return 100 * (speed / band.speed[chosen] - 1)

    # differences of 1 %: single precision makes smaller ones uneven
    solution = least_squares(left, [1.0, 1.0], diff_step=0.01, ftol=1e-6, xtol=1e-4)
    modulus, mass = solution.x * start
    return Fit(float(modulus), float(mass), float(2 * solution.cost))


def formula_off(band: Slingshot, chosen: np.ndarray) -> np.ndarray:
    """As `off`, by v^2 = 2 W/(m + m_e) with W and m_e of the chosen (n,) pellets."""

    def percent(q: np.ndarray) -> np.ndarray:
        return 100 * (np.sqrt(2 * q[0] / (band.mass + q[1])) / band.speed - 1)

    start = [band.weight * (band.draw - band.slack) / 2, band.sized_mass / 3]
    return percent(least_squares(lambda q: percent(q)[chosen], start, x_scale=start).x)


def modulus_by_weight(band: Slingshot, damping: float) -> float:
    """Young's modulus [Pa] with which the rod pulls by the draw weight, as it grows with it."""
    done = launches(band, START, band.sized_mass, damping, band.mass[:1])
    return START * band.weight / float(done.hold_force[0])


def rms(values: np.ndarray) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def predicted(bands: list[Slingshot], split: Split) -> dict:
    """Fit the chosen pellets of each band and predict the others; all, where all are chosen.

    The damping is that of all bands, and beside it that of the other five. "energy_rms" is of the
    predicted pellets' measured energy over the rod's, less 1.
    """
    chosen = [split(len(band.mass)) for band in bands]
    fits = [
        [fitted(band, damping, mask) for damping in DAMPINGS]
        for band, mask in zip(bands, chosen, strict=True)
    ]
    cost = np.array([[fit.cost for fit in of_band] for of_band in fits])
    common = int(cost.sum(0).argmin())
    rows, every = {}, {}
    for number, (band, mask) in enumerate(zip(bands, chosen, strict=True)):
        asked = mask if mask.all() else ~mask
        other, fit = int((cost.sum(0) - cost[number]).argmin()), fits[number][common]
        left = {
            "rod": off(band, fit, DAMPINGS[common]),
            "rod, damping of the other bands": off(band, fits[number][other], DAMPINGS[other]),
            "formula": formula_off(band, mask),
        }
        for name, values in left.items():
            every.setdefault(name, []).extend(values[asked])
        by_weight = modulus_by_weight(band, DAMPINGS[common])
        rows[band.name] = {
            "modulus": fit.modulus,
            "modulus_over_that_by_weight": fit.modulus / by_weight,
            "moving_mass_over_that_by_size": fit.mass / band.sized_mass,
            "rms_percent": {name: rms(values[asked]) for name, values in left.items()},
            "off_percent": left["rod"],
        }
    return {
        "damping_s": DAMPINGS[common],
        "predicted": len(every["rod"]),
        "rms_percent": {name: rms(values) for name, values in every.items()},
        "worst_percent": {name: np.abs(values).max() for name, values in every.items()},
        "energy_rms": rms((1 + np.array(every["rod"]) / 100) ** -2 - 1),
        "bands": rows,
    }


def without_a_launch(bands: list[Slingshot], damping: float) -> dict:
    """Speeds by the draw weight and the sizes alone; then one pellet corrects the energy."""
    rows, every, corrected = {}, [], []
    for band in bands:
        fit = Fit(modulus_by_weight(band, damping), band.sized_mass, np.nan)
        left = off(band, fit, damping)
        middle, ratio = len(left) // 2, 1 + left / 100
        rest = np.delete(100 * (ratio / ratio[middle] - 1), middle)
        every.extend(left)
        corrected.extend(rest)
        rows[band.name] = {
            "modulus": fit.modulus,
            "off_percent": left,
            "energy_measured_over_predicted": float(np.mean(ratio**-2)),
            "one_pellet_rms_percent": rms(rest),
        }
    return {
        "rms_percent": rms(np.array(every)),
        "one_pellet_rms_percent": rms(np.array(corrected)),
        "energy_measured_over_predicted": spread(
            row["energy_measured_over_predicted"] for row in rows.values()
        ),
        "bands": rows,
    }


def spread(values: Iterable[float]) -> dict[str, float]:
    """Mean and standard deviation between bands."""
    each = np.array([*values])
    return {"mean": each.mean(), "sd": each.std(ddof=1)}


def result(bands: list[Slingshot]) -> dict:
    """All of it, but where it comes from."""
    splits = {name: predicted(bands, split) for name, split in SPLITS.items()}
    whole = splits["all"]
    damping = whole["damping_s"]
    far = [
        off(band, Fit(row["modulus"], row["moving_mass_over_that_by_size"] * band.sized_mass, 0.0),
            damping, FINER) - row["off_percent"]
        for band, row in zip(bands, whole["bands"].values(), strict=True)
    ]  # fmt: skip
    return {
        "pellets_g": {band.name: 1e3 * band.mass for band in bands},
        "scatter_of_a_pellet_percent": 100 * np.median(np.concatenate([b.scatter for b in bands])),
        "finer_mesh_and_steps_move_it_by_percent": rms(np.concatenate(far)),
        "fitted_to": splits,
        "returned_energy": {
            "of what the weight says, mass fitted": spread(
                row["modulus_over_that_by_weight"] for row in whole["bands"].values()
            ),
            "of other pellets, by a rod fitted to three of the band, rms": splits[
                "lightest, middle, heaviest"
            ]["energy_rms"],
        },
        "without_a_launch": without_a_launch(bands, damping),
    }


def main() -> None:
    parser = runner.parser(__doc__, REPORT)
    parser.add_argument("--data", type=Path, required=True, help="folder of the measurements")
    args = parser.parse_args()
    if not (args.data / FILE).is_file():
        raise UserError(f"--data {args.data}: has no file {FILE}")
    content = {
        "kind": "measured by others, real launches",
        "asked": "Does the rod predict the speeds of pellets that it was not fitted to?",
        "source": SOURCE,
    } | result(read(args.data / FILE))
    write_report(args.report, plain(content, 4), "--data ../shared/data/real")
    print(f"wrote {args.report}")


if __name__ == "__main__":
    errors.run(main)
