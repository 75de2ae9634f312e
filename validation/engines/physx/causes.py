"""Why an exported band holds less in PhysX: its stage changed in one thing at a time.

    python -m validation.engines.physx.causes USD_FOLDER YAML_FOLDER

The folders are what `sling export` writes of the same band. Each variant is drawn to the
nearest and the farthest draw of the YAML file and held, as in exported.py; `exported` is the stage
as it is. Writes reports/validation/export-usd-causes.json. Needs a GPU; not run yet.
"""

from __future__ import annotations

import argparse
import json
import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from ruamel.yaml import YAML

from pipeline.base import errors
from pipeline.base.environment import environment
from pipeline.base.files import write_json
from pipeline.params import load
from validation.engines.physx.bands import Engine, release
from validation.engines.physx.exported import ExportedBand, compared

REPORT = Path("reports/validation/export-usd-causes.json")
CLAMPS = re.compile(r'\n    def (?:Xform "Clamp|OmniPhysicsVtxXformAttachment ").*?\n    }\n', re.S)


@dataclass(frozen=True)
class LedEnds(ExportedBand):
    """An exported band whose ends are led with the hand, as those of the study, not attached."""

    def job(self, place: np.ndarray) -> dict:
        job, tube = super().job(place), self.tube
        rows = np.arange(tube.mass.size).reshape(tube.rest.shape[:2])
        ends = rows[[0, 1, -2, -1]].ravel()
        there = tube.clamped.reshape(-1, 3)[ends]
        for phase in (0, 1):
            targets = job[f"targets_{phase}"]
            held = np.broadcast_to(there, (len(targets), *there.shape))
            job[f"targets_{phase}"] = np.concatenate([targets, held], axis=1)
            job[f"vertices_{phase}"] = np.concatenate([job[f"vertices_{phase}"], ends])
        return job


def with_property(band: ExportedBand, name: str, value: object) -> ExportedBand:
    """The stage with a property set to another value. Raises ValueError where it has none."""
    text, count = re.subn(rf"(\b{re.escape(name)} = ).+", rf"\g<1>{value}", band.text)
    if not count:
        raise ValueError(f"the stage has no {name}")
    return replace(band, text=text)


def with_poisson(band: ExportedBand, poisson: float) -> ExportedBand:
    changed = with_property(band, "omniphysics:poissonsRatio", poisson)
    return replace(changed, poisson=poisson)


def with_rate(band: ExportedBand, rate: int) -> ExportedBand:
    changed = with_property(band, "physxScene:timeStepsPerSecond", rate)
    return replace(changed, rate=rate)


def with_points_at_rest(band: ExportedBand) -> ExportedBand:
    """The stage opens with the straight band, which the clamps then bend."""
    rest = re.search(r"restShapePoints = (.+)", band.text)
    assert rest
    return with_property(band, "point3f[] points", rest[1])


def with_led_ends(band: ExportedBand) -> ExportedBand:
    return LedEnds(**vars(replace(band, text=CLAMPS.sub("\n", band.text))))


def without_collision(band: ExportedBand) -> ExportedBand:
    return replace(band, text=band.text.replace('"PhysicsCollisionAPI", ', ""))


def with_mass(band: ExportedBand, factor: float) -> ExportedBand:
    total = factor * band.tube.mass.sum()
    changed = with_property(band, "omniphysics:mass", f"{total:.9g}")
    return replace(changed, tube=replace(band.tube, mass=factor * band.tube.mass))


VARIANTS: dict[str, Callable[[ExportedBand], ExportedBand]] = {
    "exported": lambda band: band,
    "ends led, not attached": with_led_ends,
    "points at rest": with_points_at_rest,
    "points at rest, ends led": lambda band: with_led_ends(with_points_at_rest(band)),
    "Poisson's ratio 0.45": partial(with_poisson, poisson=0.45),
    "Poisson's ratio 0.30": partial(with_poisson, poisson=0.30),
    "256 iterations": lambda band: with_property(
        band, "physxDeformableBody:solverPositionIterationCount", 256
    ),
    "1,000 steps a second": partial(with_rate, rate=1000),
    "drawn and held four times as long": partial(replace, times=(1.0, 8.0, 4.0)),
    "no collision": without_collision,
    "four times the mass": partial(with_mass, factor=4.0),
}


def main() -> None:
    """Change, draw, write. Raises UserError."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("usd", type=Path)
    parser.add_argument("yaml", type=Path)
    requested = parser.parse_args()
    version = release()
    name = json.loads((requested.usd / "card.json").read_text("utf-8"))["band"]
    launches = YAML(typ="safe").load(requested.yaml / f"{name}.yaml")["launches"]
    launches.sort(key=lambda launch: np.hypot(*launch["draw_m"]))
    band, stiffness = ExportedBand.read(requested.usd / f"{name}.usda"), load().setup.arm_stiffness
    rows = {}
    with Engine() as engine:
        for variant, change in VARIANTS.items():
            rows[variant] = compared(change(band), [launches[0], launches[-1]], stiffness, engine)
            held = [100 * (row["hold_force_error"] or np.nan) for row in rows[variant]]
            print(f"{variant}: {held[0]:+.1f} and {held[1]:+.1f} % of the force held", flush=True)
    content = {"requested": "One change at a time; what it holds beside the calibrated simulation."}
    described = environment("cuda:0", "python -m validation.engines.physx.causes USD YAML")
    described["versions"] |= {"ovphysx": version}
    write_json(REPORT, content | {"band": name, "variants": rows} | described)


if __name__ == "__main__":
    errors.run(main)
