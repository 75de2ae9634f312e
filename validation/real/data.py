"""Measurements by others, as their files hold them; each folder's README names the source."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

SLACK = 1.05  # stretch below which a crosshead shows grips and slack


@dataclass(frozen=True)
class Curve:
    """A specimen drawn and led back.

    Attributes:
        name: Of the material, or of the publication and the mode.
        stretch, stress: Of the n points; stress nominal, in the file's unit; shape (n,) each.
        time: [s], shape (n,); None where nobody says.
    """

    name: str
    stretch: np.ndarray
    stress: np.ndarray
    time: np.ndarray | None = None

    def up_to(self, most: float, least: float = 1.0) -> Curve:
        """Without what is beyond."""
        chosen = (self.stretch <= most) & (self.stretch >= least)
        time = None if self.time is None else self.time[chosen]
        return Curve(self.name, self.stretch[chosen], self.stress[chosen], time)


def silicones(folder: Path) -> list[Curve]:
    """19 pulls to failure: Marechal and others, Soft Robotics 2021, `srmd_silicones`."""
    return [_silicone(file) for file in sorted((folder / "srmd_silicones").glob("*.csv"))]


def _silicone(file: Path) -> Curve:
    rows = []
    for line in file.read_text(encoding="utf-8", errors="replace").splitlines():
        try:
            rows.append([float(cell.replace(",", ".")) for cell in line.split(";")[:5]])
        except ValueError:
            continue
    time, _, _, strain, stress = np.array([row for row in rows if len(row) == 5]).T
    return Curve(file.stem, 1 + strain, stress, time)


def multiaxial(folder: Path) -> dict[str, dict[str, np.ndarray]]:
    """Read stretches and nominal stresses (n, 5) by publication and mode: F11, F22, F33, S11, S22.

    Cauchy stresses are taken back to nominal ones.
    """
    table = pd.read_csv(folder / "rubber_multiaxial" / "rubber_multiaxial.csv")
    for stress, stretch in (("S11", "F11"), ("S22", "F22")):
        true = table.stress_type == "cauchy"
        table[stress] = table[stress].where(~true, table[stress] / table[stretch])
    columns = ["F11", "F22", "F33", "S11", "S22"]
    return {
        source: {
            mode: rows[columns].to_numpy(float) for mode, rows in of.groupby("mode", sort=False)
        }
        for source, of in table.groupby("source", sort=False)
    }


def latex(folder: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time [s], crosshead [mm] and load [N] of latex drawn in 240 s and held for a day."""
    table = pd.read_csv(folder / "latex_relaxation_24h" / "latex_relaxation_24h.csv")
    table = table.drop_duplicates("time_s").sort_values("time_s")
    return tuple(table[name].to_numpy() for name in ("time_s", "displacement_mm", "load_N"))


def acrylic(folder: Path) -> list[Curve]:
    """VHB 4910, no rubber: cycles at three rates and holds of 400 s."""
    tables = {file.stem: pd.read_csv(file) for file in sorted((folder / "vhb4910").glob("*.csv"))}
    return [
        Curve(name, stretch, stress, time)
        for name, (time, stretch, stress) in (
            (name, table.to_numpy(float).T[:3]) for name, table in tables.items()
        )
    ]
