"""Whether the held force is one that a drawn band makes: its direction, weight and stiffness."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from sling2sim2real.recording.checks.finding import Check, Finding
from sling2sim2real.recording.hold import Hold, hold_of
from sling2sim2real.recording.processed import Processed

SURE = 3.0  # standard errors, each about a degree, from which a direction is off
ASTRAY = np.deg2rad(7.0)  # beyond those: too far to be used
RUBBERS = (0.06e6, 12e6)  # Pa: Young's moduli of rubbers
NO_RUBBER = (0.01e6, 50e6)  # Pa: those of none
LIGHT = 0.25  # of the band's weight on the hand: a slack band weighs more, by what it hangs from
WEIGHS = 0.7  # of its weight, as it hangs from tips and hand
UNITS = {  # newtons in one
    "millinewtons": 1e-3,
    "centinewtons": 1e-2,
    "grams-force": 9.81e-3,
    "pounds-force": 4.45,
    "kilograms-force": 9.81,
    "kilonewtons": 1e3,
}

DIRECTION = Check(
    "direction",
    "the held force with the plane of the band's two strands and their resultant, less half the"
    " band's weight",
    "about 1 degree: 5 mm of the hand's place, half a degree of the sensor's frame, the zero's",
    f"{SURE:g} standard errors",
    f"{np.degrees(ASTRAY):g} degrees more",
    "check the turn from the hand to the wrench's frame (/tf_static), then base_to_fork",
)
STIFFNESS = Check(
    "units",
    "the held force with a rubber's modulus, and the slack band's weight with its mass",
    "a factor of 2 of the modulus, by the law; the zero's of the weight",
    f"Young's modulus below {RUBBERS[0] / 1e6:g} or above {RUBBERS[1] / 1e6:g} MPa, or less than"
    f" {LIGHT:g} of the weight",
    f"below {NO_RUBBER[0] / 1e6:g} or above {NO_RUBBER[1] / 1e6:g} MPa",
    "let the driver publish newtons, or check the band's diameter, rest length and mass",
)
CHECKS = (DIRECTION, STIFFNESS)


def findings(done: Processed) -> Iterator[Finding]:
    hold = hold_of(done)
    yield from _of_stiffness(hold)
    if not done.weighed:  # its weight turns the force by degrees
        return
    ways = ("lifts", "presses down"), ("pulls to the right", "pulls to the left")
    directions = "out of its plane", "off the middle of its strands"
    for k, force in enumerate((hold.lift, hold.aside)):
        angle, error = float(abs(hold.angles[k])), float(hold.errors[k])
        if angle > SURE * error:
            what = f"the band {ways[k][int(force < 0)]} the hand by {abs(force):.1f} N,"
            what += f" {np.degrees(angle):.1f} ± {np.degrees(error):.1f} degrees {directions[k]}"
            refused = angle > SURE * error + ASTRAY
            yield DIRECTION.found(what, refused=refused)


def _of_stiffness(hold: Hold) -> Iterator[Finding]:
    soft, hard = hold.modulus < RUBBERS[0], hold.modulus > RUBBERS[1]
    # One that feels no weight at all tells of a sensor that estimates, not of units.
    weighs = hold.weight is not None and hold.weight > SURE * hold.weight_error
    light = weighs and (hold.weight or 0) + SURE * hold.weight_error < LIGHT
    if not (soft or hard or light):
        return
    what = f"a band that holds {hold.size:.3g} N here would be of {_pascals(hold.modulus)}"
    if weighs:
        what += f" and weigh {hold.weight:.2g} times its mass on the hand"
    unit = _unit(hold.modulus, hold.weight if weighs else None)
    if unit:
        what += f": the force seems to be in {unit}"
    refused = not NO_RUBBER[0] < hold.modulus < NO_RUBBER[1]
    yield STIFFNESS.found(what, refused=refused)


def _unit(modulus: float, weight: float | None) -> str:
    """Name the unit that makes a rubber of the band and its weight right; several where alike."""
    fitting = [
        name
        for name, newtons in UNITS.items()
        if RUBBERS[0] < modulus * newtons < RUBBERS[1]
        and (weight is None or LIGHT < weight * newtons < 1 / WEIGHS)
    ]
    if weight is None:
        return " or ".join(fitting)
    fitting.sort(key=lambda name: abs(np.log(weight * UNITS[name] / WEIGHS)))
    # What differs by a few percent neither weight nor modulus shows.
    return " or ".join(name for name in fitting if 0.9 < UNITS[name] / UNITS[fitting[0]] < 1.1)


def _pascals(modulus: float) -> str:
    return f"{modulus / 1e6:.3g} MPa" if modulus >= 1e5 else f"{modulus / 1e3:.3g} kPa"
