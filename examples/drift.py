"""Has a band changed between its recordings? Each is identified alone; differences are tested.

    python examples/drift.py --mass 0.0408 may.mcap june.mcap

A change of E or of the damping product is one that chance explains in less than 5 % of all cases,
with Bonferroni's correction for the number of comparisons.
"""

import argparse
from itertools import combinations

import numpy as np
from scipy.stats import norm

import sling2sim2real as s2s

QUANTITIES = ("youngs_modulus", "damping_product")
FALSE_ALARM = 0.05
NINE_OF_TEN = norm.ppf(0.95)  # standard deviations on either side


def changes(values: dict[str, dict[str, s2s.Interval]]) -> list[str]:
    """What differs beyond chance between recordings, given their intervals by file and quantity."""
    pairs = [(*pair, name) for pair in combinations(values, 2) for name in QUANTITIES]
    found = []
    for earlier, later, name in pairs:
        before, after = values[earlier][name], values[later][name]
        spread = [np.log(one.high / one.low) / (2 * NINE_OF_TEN) for one in (before, after)]
        ratio = after.value / before.value
        chance = 2 * norm.sf(abs(np.log(ratio)) / np.hypot(*spread)) * len(pairs)
        if chance < FALSE_ALARM:
            found.append(f"{name}: {100 * (ratio - 1):+.0f} % from {earlier} to {later}")
    return found


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("recordings", nargs="+", help="MCAP files of one band, the oldest first")
    parser.add_argument("--mass", type=float, required=True, help="of the band, in kg")
    arguments = parser.parse_args()
    band = s2s.Band(mass=arguments.mass, diameter=0.010, rest_length=0.52)
    values = {}
    for recording in arguments.recordings:
        episodes = s2s.read_mcap(recording, band)
        values[recording] = s2s.identify(episodes, band).intervals
        for name in QUANTITIES:
            one = values[recording][name]
            print(f"{recording}: {name} {one.value:.3g} ({one.low:.3g} to {one.high:.3g})")
    print("\n".join(changes(values) or ["no change beyond chance"]))


if __name__ == "__main__":
    main()
