"""Where a launch of a band of the virtual rig lands [m], as a lab would measure it.

python -m tools.virtual_launch band1 -0.30 -0.15    # band, draw (y, z) in m
"""

from __future__ import annotations

import sys

from pipeline.params import load
from rig.physics.launch import launch


def main() -> None:
    band, *draw = sys.argv[1:]
    print(f"{launch(band, load(), tuple(map(float, draw)), 1).landing_y:.3f}")


if __name__ == "__main__":
    main()
