"""The policies: how they converged, and where they draw."""

from __future__ import annotations

import numpy as np

from pipeline.drawing.styles import Styles
from pipeline.landing.landing_map import LandingMap
from pipeline.report.results import Results
from pipeline.report.tables.cells import NONE, Table, centimetres, number


def aims(named: dict[str, tuple[LandingMap, np.ndarray]], targets: np.ndarray) -> Table:
    """What draws come to in a calibrated simulator.

    Args:
        named: By whose they are, the simulator's map and draws (N, 2) [m] for `targets` (N,) [m].
    """
    rows = []
    for name, (landing_map, draws) in named.items():
        landed = landing_map(draws)
        answers = zip(landed.landing_y, landed.hold_force, landed.failure, strict=True)
        for target, (y, z), (landing, force, code) in zip(targets, draws, answers, strict=True):
            predicted = number(landing, ".3f", landing_map.reasons[code])
            drawn = f"{target:.3f}", f"{y:.4f}, {z:.4f}"
            rows.append([name, *drawn, predicted, number(force, ".1f")])
    return ["policy", "target [m]", "draw y, z [m]", "predicted [m]", "hold force [N]"], rows


def policies(results: Results, styles: Styles) -> Table:
    """How each policy converged in its own simulator, and how well its map interpolates."""
    heads = ["band", "method", "converged", "mean error [cm]", "largest"]
    heads += ["failed targets", "map error", "largest"]
    rows = []
    for one in results:
        training, near = one.card["training"], one.card["landing_map"]["target_range"]
        rows.append(
            [
                one.band,
                styles[one.method].name,
                "yes" if training["converged"] else "**no**",
                *_errors(training),
                str(training.get("failed_targets", NONE)),
                *_errors(near),
            ]
        )
    return heads, rows


def _errors(about: dict) -> list[str]:
    return [centimetres(about[name]) for name in ("mean_error_m", "max_error_m")]
