"""What an exported band holds in PhysX, its stage or its steps changed in one thing at a time.

    python -m validation.engines.physx.causes USD_FOLDER YAML_FOLDER

The folders are what `sling export` writes of the same band. Each variant is drawn to the nearest
and the farthest draw of the YAML file and held, as in exported.py; `exported` is the stage as it
is. Beside the force stands how much of its volume the free band has then: a stage that opens with
a bent band collapses across. Writes reports/validation/export-usd-causes.json. Needs a GPU.
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
from pipeline.base.errors import UserError
from pipeline.export.usd import UsdBand
from pipeline.params import load
from validation.engines.physx.bands import Engine, release
from validation.engines.physx.exported import Steps, held, read, yielded
from validation.engines.physx.scene import tuples
from validation.reports import write_report

REPORT = Path("reports/validation/export-usd-causes.json")
ITERATIONS = "physxDeformableBody:solverPositionIterationCount"
CLAMP = """
    def Xform "Clamp%(side)s"
    {
        double3 xformOp:translate = %(place)s
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }

    def OmniPhysicsVtxXformAttachment "Hold%(side)s"
    {
        point3f[] omniphysics:localPositionsSrc1 = %(offsets)s
        rel omniphysics:src0 = </World/Band>
        rel omniphysics:src1 = </World/Clamp%(side)s>
        int[] omniphysics:vtxIndicesSrc0 = %(vertices)s
    }
"""


@dataclass(frozen=True)
class Variant:
    """A stage, the band that it says, and its steps.

    Attributes:
        bent: It opens with the band where it hangs, not with the straight one.
    """

    text: str
    band: UsdBand
    steps: Steps = Steps()
    bent: bool = False


def with_property(variant: Variant, name: str, value: object) -> Variant:
    """The stage with a property set to another value. Raises ValueError where it has none."""
    text, count = re.subn(rf"(\b{re.escape(name)} = ).+", rf"\g<1>{value}", variant.text)
    if not count:
        raise ValueError(f"the stage has no {name}")
    return replace(variant, text=text)


def with_poisson(variant: Variant, poisson: float) -> Variant:
    changed = with_property(variant, "omniphysics:poissonsRatio", poisson)
    return replace(changed, band=replace(variant.band, poisson=poisson))


def with_rate(variant: Variant, rate: int) -> Variant:
    changed = with_property(variant, "physxScene:timeStepsPerSecond", rate)
    return replace(changed, steps=replace(variant.steps, rate=rate))


def opened_bent(variant: Variant) -> Variant:
    """The stage's `points` are where the band hangs; it is at rest as it was."""
    places = variant.band.tube.clamped.reshape(-1, 3)
    changed = with_property(variant, "point3f[] points", tuples(places, ".9g"))
    return replace(changed, bent=True)


def with_attachments(variant: Variant) -> Variant:
    """Add attachments that hold the ends, which are led anyway."""
    tube, parts = variant.band.tube, []
    ends = variant.band.ends.reshape(2, -1)
    for side, tip, vertices in zip(("Left", "Right"), tube.clamped[[1, -2], 0], ends, strict=True):
        values = {
            "side": side,
            "place": tuples(tip[None], ".9g")[1:-1],
            "vertices": vertices.tolist(),
            "offsets": tuples(tube.clamped.reshape(-1, 3)[vertices] - tip, ".9g"),
        }
        parts.append(CLAMP % values)
    body = variant.text.rstrip().removesuffix("}")
    return replace(variant, text=f"{body}{''.join(parts)}}}\n")


VARIANTS: dict[str, Callable[[Variant], Variant]] = {
    "exported": lambda variant: variant,
    "opened bent": opened_bent,
    "opened bent, ends attached too": lambda variant: with_attachments(opened_bent(variant)),
    "opened bent, Poisson's ratio 0.30": lambda v: with_poisson(opened_bent(v), 0.30),
    "opened bent, 256 iterations": lambda v: with_property(opened_bent(v), ITERATIONS, 256),
    "damping 2 ms": lambda v: with_property(v, "elasticityDamping", 0.002),
    "Poisson's ratio 0.30": partial(with_poisson, poisson=0.30),
    "256 iterations": lambda v: with_property(v, ITERATIONS, 256),
    "1,000 steps a second": partial(with_rate, rate=1000),
    "drawn and held three times as long": lambda v: replace(v, steps=Steps(times=(1.0, 6.0, 3.0))),
}


def measured(engine: Engine, variant: Variant, launches: list[dict], stiffness) -> list[dict]:
    """Hold each draw of the calibrated simulation by a variant in PhysX."""
    rows = []
    for launch in launches:
        draw, ours = np.array(launch["draw_m"]), launch["hold_force_n"]
        place = np.append(0.0, yielded(draw[None], np.array([ours]), stiffness)[0])
        opens = variant.band.tube.clamped if variant.bent else variant.band.tube.rest
        force, volume = held(engine, variant.text, variant.band, place, variant.steps, opens=opens)
        sound = bool(np.isfinite(force))
        rows.append(
            {
                "draw_m": draw.tolist(),
                "hold_force_n": ours,
                "hold_force_there_n": force if sound else None,
                "hold_force_error": force / ours - 1 if sound else None,
                "volume_left": volume if sound else None,
            }
        )
    return rows


def main() -> None:
    """Change, draw, write. Raises UserError."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("usd", type=Path)
    parser.add_argument("yaml", type=Path)
    requested = parser.parse_args()
    version, (text, band) = release(), read(requested.usd)
    name = json.loads((requested.usd / "card.json").read_text("utf-8"))["band"]
    if not (numbers := requested.yaml / f"{name}.yaml").exists():
        raise UserError(f"{numbers}: no such file; `sling export --to yaml` writes it")
    launches = YAML(typ="safe").load(numbers).get("launches")
    if not launches:
        raise UserError(f"{numbers}: has no launches; `sling export --to yaml` writes them")
    launches.sort(key=lambda launch: np.hypot(*launch["draw_m"]))
    stiffness, rows = load().setup.arm_stiffness, {}
    content = {
        "asked": "One change at a time; what it holds beside the calibrated simulation.",
        "band": name,
        "variants": rows,
    }
    options = {"device": "cuda:0", "versions": {"ovphysx": version}}
    with Engine() as engine:
        for variant, change in VARIANTS.items():
            stage = change(Variant(text, band))
            rows[variant] = measured(engine, stage, [launches[0], launches[-1]], stiffness)
            force = [100 * (row["hold_force_error"] or np.nan) for row in rows[variant]]
            volume = 100 * (rows[variant][0]["volume_left"] or np.nan)
            print(
                f"{variant}: {force[0]:+.1f} and {force[1]:+.1f} % of the force held,"
                f" {volume:.0f} % of the volume",
                flush=True,
            )
            write_report(REPORT, content, "USD YAML", **options)


if __name__ == "__main__":
    errors.run(main)
