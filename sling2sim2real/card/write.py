"""Write a band's card into a folder: what is known of it, for a person and for a program."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import numpy as np

from sling2sim2real.base.files import replacing_folder, write_json, write_text
from sling2sim2real.card import figures
from sling2sim2real.card.animation import animate
from sling2sim2real.card.camera import Pictures
from sling2sim2real.card.conclusion import Conclusion
from sling2sim2real.card.inputs import CardInputs
from sling2sim2real.card.simulated import simulate
from sling2sim2real.card.text import card_text
from sling2sim2real.drawing.page import page

SIZES = "mass", "diameter", "rest_length"  # kg, m, m


def write(to: Path, inputs: CardInputs, pictures: Pictures, digest: str | None = None) -> dict:
    """Write a band's card into the folder `to`; return what card.json says.

    Args:
        pictures: Of the first pull.
        digest: Of all that it rests on, in a band's folder.

    Raises:
        UserError: θ fails in simulation.
    """
    episode, params = inputs.episode, inputs.params
    simulated = simulate(inputs.found, episode)
    concluded = Conclusion.of(inputs, simulated.force)
    card = content(inputs, concluded)
    with replacing_folder(to) as folder:
        figures.camera(folder / "camera.webp", episode, simulated, pictures)
        figures.force(folder / "force.png", episode, simulated)
        figures.landings(folder / "landings.png", inputs)
        animate(folder / "animation.webp", episode, simulated, pictures, params.setup.fork_width)
        write_text(folder / "README.md", card_text(inputs, concluded))
        text = card_text(inputs, concluded, linked=False)
        write_text(folder / "index.html", page(text, folder, f"{inputs.band}: {card['verdict']}"))
        write_json(folder / "card.json", card | ({"digest": digest} if digest else {}))
    return card


def content(inputs: CardInputs, concluded: Conclusion) -> dict:
    """What card.json says; numbers are rounded, so that kinds of CPU agree."""
    aims = inputs.aims
    draws = [
        {
            "target_m": target,
            "draw_y_m": _rounded(draw[0], 4),
            "draw_z_m": _rounded(draw[1], 4),
            "predicted_landing_m": _rounded(landing, 3),
            "interval_90_m": _ends(ends),
            "median_landing_m": _rounded(median, 3),
            "hold_force_n": _rounded(force, 2),
        }
        for target, draw, landing, ends, median, force in zip(
            aims.target.tolist(), aims.draw, aims.landing, aims.interval, aims.median,
            aims.hold_force,
            strict=True,
        )
    ]  # fmt: skip
    return {
        "band": inputs.band,
        "method": inputs.method,
        "verdict": concluded.verdict,
        "reasons": concluded.reasons,
        "values": [asdict(value) for value in concluded.values],
        "draws": draws,
        "next": concluded.steps,
        "sizes": {name: getattr(inputs.found.band, name) for name in SIZES},
        "assumed": list(inputs.assumed),
        "recordings": len(inputs.recordings),
        "pulls": len(inputs.episodes),
        "launches": inputs.launches,
    }


def _ends(interval: np.ndarray) -> list[float] | None:
    return [round(end, 3) for end in interval.tolist()] if np.isfinite(interval).all() else None


def _rounded(value: float, digits: int) -> float | None:
    return round(float(value), digits) if np.isfinite(value) else None
