"""What `sling export` prints."""

from __future__ import annotations

from pathlib import Path

from sling2sim2real.exporting.match import HOLD_LIMIT, LANDING_LIMIT


def shown(folder: Path, content: dict) -> str:
    """Files, and how near the replay in the engine comes."""
    lines = [f"{folder}: {', '.join(sorted([*content['files'], 'card.json']))}"]
    for row in content.get("proof", []):
        lines.append(
            f"draw {row['draw_y_m']:.3f}, {row['draw_z_m']:.3f} m:"
            f" hold {row['hold_force_n']:.2f} N ({100 * row['hold_force_error']:+.1f} % there),"
            f" landing {row['landing_m']:.2f} m ({100 * row['landing_error']:+.1f} % there)"
        )
    if "proof" in content:
        lines.append(
            f"{content['engine']}, draws that took no part in the match: asked"
            f" {100 * HOLD_LIMIT:g} and {100 * LANDING_LIMIT:g} %, "
            + ("met" if content["met"] else "NOT met")
        )
    if sampled := content.get("samples"):
        lines += [
            f"sample {row['sample']}: hold {100 * row['hold_force_error']:+.1f} %,"
            f" landing {100 * row['landing_error']:+.1f} % there, at worst"
            for row in sampled["replayed"]
        ]
    return "\n".join(lines)
