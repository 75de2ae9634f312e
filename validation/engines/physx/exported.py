"""Open an exported band in PhysX, draw it and hold it: what `sling export --to usd` is worth there.

    python -m validation.engines.physx.exported USD_FOLDER YAML_FOLDER

The folders are what `sling export` writes of the same band. The stage is opened as it is, clamps
and all; only the hand, which it leaves to its user, is added: the middle section, led to each draw
of the YAML file and held there. Writes reports/validation/export-usd.json.
"""

from __future__ import annotations

import argparse
import ast
import json
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from ruamel.yaml import YAML

from pipeline.base import errors
from pipeline.base.environment import environment
from pipeline.base.errors import UserError
from pipeline.base.files import write_json
from pipeline.export.mesh import Tube
from pipeline.params import load
from pipeline.simulator.cylinder import volumes
from pipeline.simulator.model import GRAVITY
from validation.engines.physx.bands import Engine, release
from validation.engines.physx.law import force_on

REPORT = Path("reports/validation/export-usd.json")
HANG, PULL, HOLD = 1.0, 2.0, 1.0  # s
FALLS = 0.02  # m, at most, in the step in which the stage is opened: its clamps bend the band
LIMIT, SLIP = 0.02, 1e-3  # of the force held, as of MuJoCo and Newton; m that clamps may yield
ASKED = (
    f"The exported stage opens in PhysX, its clamps keep the band's ends within {1e3 * SLIP:g} mm,"
    f" and drawn it holds within {LIMIT:.0%} of the calibrated simulation."
)


@dataclass(frozen=True)
class ExportedBand:
    """An exported stage, read back.

    Attributes:
        text: The stage, in USD's text form.
        tube: Its mesh; `hanging` and `clamped` are where it begins, `arc` is empty.
        young, poisson: Of its material [Pa, -].
        rate: Steps a second that it asks for.
        times: That it hangs, is drawn, and is held [s].
    """

    text: str
    tube: Tube
    young: float
    poisson: float
    rate: int
    times: tuple[float, float, float] = (HANG, PULL, HOLD)

    @classmethod
    def read(cls, path: Path) -> ExportedBand:
        """Raises UserError where the file is not one of ours."""
        try:
            text = path.read_text(encoding="utf-8")
            rest = np.array(_value(text, "point3f[] omniphysics:restShapePoints"), float)
            begin = np.array(_value(text, "point3f[] points"), float)
            tetrahedra = np.array(_value(text, "int4[] tetVertexIndices"), int)
            mass = _value(text, "float omniphysics:mass")
            young = _value(text, "float omniphysics:youngsModulus")
            poisson = _value(text, "float omniphysics:poissonsRatio")
            rate = _value(text, "uint physxScene:timeStepsPerSecond")
        except (OSError, ValueError) as error:
            raise UserError(f"{path}: {error}; `sling export --to usd` writes it") from error
        count = int(np.isclose(rest[:, 0], rest[0, 0]).sum())
        rest, begin = (points.reshape(-1, count, 3) for points in (rest, begin))
        share = np.repeat(volumes(rest, tetrahedra) / 4, 4)
        weight = np.bincount(tetrahedra.ravel(), share)
        mass = mass * weight / weight.sum()
        tube = Tube(rest, tetrahedra, mass, begin, begin, np.zeros(0))
        return cls(text, tube, young, poisson, rate)

    def job(self, place: np.ndarray) -> dict:
        """What worker.py is to do: hang the band, and lead its middle to `place` (3,) [m]."""
        tube = self.tube
        rows = np.arange(tube.mass.size).reshape(tube.rest.shape[:2])
        flat = tube.clamped.reshape(-1, 3)
        hang, pull, hold = (round(time * self.rate) for time in self.times)
        part = np.minimum(np.arange(1, pull + hold + 1) / pull, 1)
        part = part**3 * (10 - 15 * part + 6 * part**2)
        begin = tube.clamped[tube.middle].mean(axis=0)
        path = begin + part[:, None] * (place - begin)
        led = path[:, None] + tube.rest[tube.middle] * [0.0, 1.0, 1.0]
        none = np.zeros(hang + pull + hold, bool)
        return {
            "step": 1 / self.rate,
            "phases": 2,
            "offsets": np.zeros((1, 3)),
            "rest": flat,
            "start": flat[None],
            "as_written": FALLS,
            "vertices_0": np.zeros(0, int),
            "targets_0": np.zeros((hang, 0, 3)),
            "fade_0": np.zeros(hang),
            "keep_0": none[:hang],
            "vertices_1": rows[tube.middle],
            "targets_1": led,
            "fade_1": 1 - part,
            "keep_1": np.arange(pull + hold) == pull + hold - 1,
        }

    def held(self, engine: Engine, place: np.ndarray) -> tuple[float, float]:
        """Force on a hand that draws the middle to `place` (3,) and holds it [N].

        By the stress of PhysX's law in the tetrahedra that it reaches. And how far the ends in the
        clamps have gone [m].
        """
        tube = self.tube
        rows = np.arange(tube.mass.size).reshape(tube.rest.shape[:2])
        done = engine.run(self.text, self.job(place))
        last = done["positions_1"][-1, 0].reshape(tube.rest.shape).astype(float)
        force = force_on(tube, [tube.middle], last, self.young, self.poisson)
        weight = tube.mass[rows[tube.middle]].sum() * GRAVITY
        ends = [0, 1, -2, -1]
        gone = np.linalg.norm(last[ends] - tube.clamped[ends], axis=-1).max()
        return float(np.linalg.norm(force - [0.0, 0.0, weight])), float(gone)


def _value(text: str, name: str):
    """What a property of the stage is set to. Raises ValueError."""
    match = re.search(rf"^\s*(?:uniform )?{re.escape(name)} = (.+)$", text, re.MULTILINE)
    if not match:
        raise ValueError(f"has no {name}")
    return ast.literal_eval(match[1].strip())


def yielded(draw: np.ndarray, force: float, stiffness: float | None) -> np.ndarray:
    """Where the middle rests (3,) when an arm of a stiffness [N/m] is sent to a draw (2,) [m]."""
    given_way = force / stiffness if stiffness else 0.0
    return np.array([0.0, *(draw - draw / np.linalg.norm(draw) * given_way)])


def compared(band: ExportedBand, launches: list[dict], stiffness, engine) -> list[dict]:
    """Each draw of the calibrated simulation, held in PhysX."""
    rows = []
    for launch in launches:
        draw, ours = np.array(launch["draw_m"]), launch["hold_force_n"]
        force, gone = band.held(engine, yielded(draw, ours, stiffness))
        sound = bool(np.isfinite(force))
        rows.append(
            {
                "draw_m": draw.tolist(),
                "hold_force_n": ours,
                "hold_force_there_n": force if sound else None,
                "hold_force_error": force / ours - 1 if sound else None,
                "clamps_yield_m": gone if sound else None,
            }
        )
    return rows


def met(rows: list[dict]) -> bool:
    """Whether each draw keeps both limits."""
    return bool(rows) and all(
        row["hold_force_error"] is not None
        and abs(row["hold_force_error"]) <= LIMIT
        and row["clamps_yield_m"] <= SLIP
        for row in rows
    )


def main() -> None:
    """Open, draw, write. Raises UserError."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("usd", type=Path)
    parser.add_argument("yaml", type=Path)
    requested = parser.parse_args()
    version, cards = release(), [folder / "card.json" for folder in (requested.usd, requested.yaml)]
    for card in cards:
        if not card.exists():
            raise UserError(f"{card.parent}: no export; `sling export` writes it")
    card = json.loads(cards[0].read_text())
    name = card["band"]
    provenance = environment("cuda:0", "python -m validation.engines.physx.exported USD YAML")
    provenance["versions"] |= {"ovphysx": version}
    launches = YAML(typ="safe").load(requested.yaml / f"{name}.yaml")["launches"]
    band, stiffness = ExportedBand.read(requested.usd / f"{name}.usda"), load().setup.arm_stiffness
    with Engine() as engine:
        rows = compared(band, launches, stiffness, engine)
    content = {"asked": ASKED, "met": met(rows), "band": name, "matched": card["matched"]}
    write_json(REPORT, content | {"draws": rows} | provenance)
    errors_there = [row["hold_force_error"] for row in rows]
    worst = max((np.inf if error is None else abs(error) for error in errors_there), default=np.nan)
    print(f"{REPORT}: {len(rows)} draws, held force off by at most {100 * worst:.1f} %")


if __name__ == "__main__":
    errors.run(main)
