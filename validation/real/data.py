"""Measurements by others, as their files hold them; each folder's README names the source."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np

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
    sources: dict[str, dict[str, list]] = {}
    file = folder / "rubber_multiaxial" / "rubber_multiaxial.csv"
    with file.open(encoding="utf-8-sig") as lines:
        for row in csv.DictReader(lines):
            stretches = [float(row[name]) for name in ("F11", "F22", "F33")]
            stresses = [float(row[name] or "nan") for name in ("S11", "S22")]
            if row["stress_type"] == "cauchy":
                stresses = [s / stretch for s, stretch in zip(stresses, stretches, strict=False)]
            modes = sources.setdefault(row["source"], {})
            modes.setdefault(row["mode"], []).append([*stretches, *stresses])
    return {source: {m: np.array(v) for m, v in modes.items()} for source, modes in sources.items()}


def latex(folder: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time [s], crosshead [mm] and load [N] of latex drawn in 240 s and held for a day."""
    file = folder / "latex_relaxation_24h" / "latex_relaxation_24h.csv"
    with file.open(encoding="utf-8-sig") as lines:
        rows = [
            [float(row[name]) for name in ("time_s", "displacement_mm", "load_N")]
            for row in csv.DictReader(lines)
        ]
    table = np.array(rows)
    table = table[np.unique(table[:, 0], return_index=True)[1]]
    return table[:, 0], table[:, 1], table[:, 2]


def acrylic(folder: Path) -> list[Curve]:
    """VHB 4910, no rubber: cycles at three rates and holds of 400 s."""
    curves = []
    for file in sorted((folder / "vhb4910").glob("*.csv")):
        with file.open(encoding="utf-8-sig") as lines:
            table = np.array([[float(cell) for cell in row] for row in list(csv.reader(lines))[1:]])
        curves.append(Curve(file.stem, table[:, 1], table[:, 2], table[:, 0]))
    return curves
