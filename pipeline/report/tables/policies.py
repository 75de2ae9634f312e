"""The policies: how they converged, and where they draw."""

from __future__ import annotations

import numpy as np

from pipeline.report.looks import Look
from pipeline.report.results import Result, Results
from pipeline.report.tables.cells import Table, number


def aims(
    results: dict[str, Result], targets: np.ndarray, draws: dict, looks: dict[str, Look]
) -> Table:
    """Draws of each method's policy, shape (N, 2) [m], for targets [m], and its simulator's say."""
    rows = []
    for method, result in results.items():
        landed = result.landing_map(draws[method])
        reasons = (result.landing_map.reasons[code] for code in landed.failure)
        columns = (targets, draws[method], landed.landing_y, landed.hold_force, reasons)
        rows += [
            [
                looks[method].name,
                f"{target:.3f}",
                f"{y:.4f}, {z:.4f}",
                number(landing, ".3f", reason),
                number(force, ".1f"),
            ]
            for target, (y, z), landing, force, reason in zip(*columns, strict=True)
        ]
    return ["method", "target [m]", "draw y, z [m]", "predicted [m]", "hold force [N]"], rows


def policies(results: Results, looks: dict[str, Look]) -> Table:
    """How each policy converged in its own simulator, and how well its map interpolates."""
    heads = ["band", "method", "converged", "mean error [cm]", "largest", "map error", "largest"]
    rows = []
    for result in results:
        training, near = result.card["training"], result.card["landing_map"]["target_range"]
        rows.append(
            [
                result.band,
                looks[result.method].name,
                "yes" if training["converged"] else "**no**",
                *(
                    number(value and 100 * value, ".2f")
                    for source in (training, near)
                    for value in (source["mean_error_m"], source["max_error_m"])
                ),
            ]
        )
    return heads, rows
