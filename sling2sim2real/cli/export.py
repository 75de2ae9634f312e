"""`sling export`: a band of a run for another engine, and what is printed of it."""

from __future__ import annotations

from pathlib import Path

from sling2sim2real.api.exporting import export
from sling2sim2real.api.identification import Identification
from sling2sim2real.base.disk import expect_writable
from sling2sim2real.base.layout import Layout
from sling2sim2real.episode.episode import Episode
from sling2sim2real.exporting.card import HOLD, LANDING
from sling2sim2real.settings import Settings, expect_known


def export_of_run(
    params: Settings, band: str, method: str, to: str, out: Path | None = None
) -> tuple[Path, dict]:
    """Export a band of the working folder, as `sling fit` or `dvc repro` found it.

    Returns its folder and its card. Raises UserError.
    """
    expect_known(params, "band", band)
    expect_known(params, "method", method)
    identification, layout = Identification.of_run(band, method), Layout()
    out = out or layout.data / "exports" / band / to
    expect_writable(out)
    there = layout.episode(band).is_dir()
    episode = Episode.load_all(layout.episodes(band))[0] if there else None
    done = export(identification, to, out, episode=episode)
    return done.folder, done.card


def shown(folder: Path, content: dict) -> str:
    """What `sling export` prints."""
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
            f" {100 * HOLD:g} and {100 * LANDING:g} %, " + ("met" if content["met"] else "NOT met")
        )
    return "\n".join(lines)
