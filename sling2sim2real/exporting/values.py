"""What an export says of the identified band, whatever the target."""

from __future__ import annotations

import numpy as np

from sling2sim2real.exporting.band import CalibratedBand
from sling2sim2real.quantities import QUANTITIES, rounded
from sling2sim2real.simulator.rubber import RUBBER

FRAMES = (
    "SI units throughout. Frame O: origin midway between the fork's tips, x along the fork, y"
    " towards the target, z up. A draw is the place (y, z) to which the arm is sent with the"
    " projectile; a landing is a distance along y on the floor."
)


def values(model: CalibratedBand) -> list[dict]:
    """List parameters with their 90 % intervals where known: name, value, unit, low, high."""
    intervals, rows = getattr(model, "intervals", {}), []
    theta = model.parameters.sample()
    for name in QUANTITIES:
        value, interval = theta.get(name), intervals.get(name)
        if value is None:
            continue
        sure = interval if interval is not None and interval.low < interval.high else None
        rows.append(
            {
                "name": name,
                "value": rounded(value, 6),
                "unit": QUANTITIES[name].si,
                "low": sure and rounded(sure.low, 6),
                "high": sure and rounded(sure.high, 6),
                "identified": bool(sure and sure.identifiable),
            }
        )
    return rows


def sizes(model: CalibratedBand) -> dict[str, float | list[float] | None]:
    """What was weighed and measured, and how the band is mounted; SI units are in the names."""
    band, setup, mounting = model.band, model.settings.setup, model.mounting
    return {
        "mass_kg": band.mass,
        "diameter_m": band.diameter,
        "rest_length_m": band.rest_length,
        "fork_width_m": setup.fork_width,
        "fork_height_m": setup.fork_height,
        "projectile_mass_kg": setup.projectile_mass,
        "arm_stiffness_n_per_m": setup.arm_stiffness,
        "clamp_direction": [
            rounded(float(component), 6) for component in model.sling.clamp_direction
        ],
        "flexural_rigidity_n_m2": mounting and rounded(mounting.flexural_rigidity, 6),
    }


def history(model: CalibratedBand) -> dict[str, float] | None:
    """Times in which the hand must draw, and must wait; None: they do not matter."""
    pull_history = model.launch_setup.history
    return pull_history and {
        "pull_time_s": rounded(pull_history.pull_time, 6),
        "pause_s": rounded(pull_history.pause, 6),
    }


def without_slot(model: CalibratedBand) -> list[dict]:
    """What springs cannot express, its value, and what stands in for it."""
    theta, setup, sling = model.parameters.sample(), model.settings.setup, model.sling
    direction, rigidity = sling.clamp_direction, sling.flexural_rigidity
    angle = np.degrees(np.arctan2(np.hypot(direction[0], direction[1]), -direction[2]))
    bending = "a solid band's" if rigidity is None else f"{rigidity:.2g} N m²"
    damping = f"{1e3 * theta['elasticity_damping']:.2g} ms, {theta['damping_scale']:.2g}"
    rows = [
        ("elasticity_damping, damping_scale", damping, "One damping time, of lengthening alone."),
        ("turn_damping", f"{theta['turn_damping']:.2g}", "None: turns of a spring cost nothing."),
        (
            "returned_share",
            f"{100 * theta['returned_share']:.3g} %",
            "The springs' damping, matched to landings.",
        ),
        (
            "poissons_ratio",
            f"{theta['poissons_ratio']:.2g}",
            "None: springs have no section; they pull as a string of constant volume.",
        ),
        (
            "dynamic_friction",
            f"{theta['dynamic_friction']:.2g}",
            "None: the hand is tied to the middle, and lets go at once.",
        ),
        (
            "clamp angle, bending stiffness",
            f"{angle:.0f} degrees, {bending}",
            "None: the chain bends freely, at its clamps too. The slack band hangs otherwise.",
        ),
        ("air", f"{setup.air_density:.2g} kg/m³", "The springs' damping, matched to landings."),
    ]
    if model.parameters.law == RUBBER:
        rows = [*_of_rubber(model), *rows]
    return [dict(zip(("name", "value", "instead"), row, strict=True)) for row in rows]


def _of_rubber(model: CalibratedBand) -> list[tuple[str, str, str]]:
    theta, pull_history = model.parameters.sample(), history(model)
    after = "it has forgotten every pull"
    if pull_history:
        after = f"a pull of {pull_history['pull_time_s']:.1f} s and a pause of"
        after += f" {pull_history['pause_s']:.1f} s"
    return [
        (
            "relaxation",
            f"{100 * theta['relaxation']:.2g} % a decade",
            f"None: the springs hold what the band holds after {after}. What relaxation takes from"
            " a launch is in their damping.",
        ),
        (
            "flow, log_flow_rate",
            f"{100 * theta['flow']:.2g} % of E, 10^{theta['log_flow_rate']:.2g}/s",
            f"None: as relaxation, after {after}.",
        ),
        (
            "mooney_share, upturn",
            f"{theta['mooney_share']:.2g}, {theta['upturn']:.2g}",
            "The shape of the springs' pull, with a share of its own.",
        ),
        (
            "softening",
            f"{100 * theta['softening']:.2g} %",
            "None: the springs hold what a band holds that was drawn so far before. What softening"
            " takes from a launch is in their damping.",
        ),
    ]
