"""All that is known of a band as one YAML file, for an engine that none of the targets is."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
from ruamel.yaml import YAML

from pipeline.base.files import write_text
from pipeline.episode.episode import Episode
from pipeline.export import values as about
from pipeline.export.band import CalibratedBand
from pipeline.export.match import draws_of
from pipeline.report.quantities import rounded
from pipeline.simulator.rubber import RUBBER, TIMES, uniaxial

STRETCHES = np.arange(1.0, 2.21, 0.1)


def to_yaml(model: CalibratedBand, folder: Path, episode: Episode | None) -> dict:
    """<band>.yaml, and README.md: how to read it."""
    name = f"{model.band.name}.yaml"
    content = content_of(model)
    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style = None
    yaml.sort_base_mapping_type_on_output = False  # pyright: ignore[reportAttributeAccessIssue]
    yaml.width = 100
    stream = io.StringIO()
    yaml.dump(content, stream)
    write_text(folder / name, f"# {READ_ME}\n{stream.getvalue()}")
    write_text(folder / "README.md", _readme(model, name, content))
    files = {name: "values, curve, launches", "README.md": "how to read it"}
    return {"band": model.band.name, "target": "yaml", "files": files, **content}


READ_ME = (
    "An identified band. README.md says how to read it; low and high: nine of ten lie between."
)


def content_of(model: CalibratedBand) -> dict:
    """What the file holds."""
    parameters, draws = model.parameters, draws_of(model)
    theta = parameters.sample()
    shape = theta.get("mooney_share", 0.0), theta.get("upturn", 0.0)
    strength = theta["youngs_modulus"] * np.pi * model.band.diameter**2 / 4
    done = model.launches(draws)
    return {
        "frames": about.FRAMES,
        "sizes": about.sizes(model),
        "law": parameters.law,
        "values": about.values(model),
        "relaxation_times_s": TIMES.tolist() if parameters.law == RUBBER else [],
        "history": about.history(model),
        "curve": {
            "stretch": [rounded(one, 4) for one in STRETCHES.tolist()],
            "pull_n": [rounded(one, 5) for one in (strength / 3 * uniaxial(STRETCHES, *shape))],
        },
        "launches": [
            {
                "draw_m": [rounded(one, 6) for one in draw],
                "hold_force_n": rounded(float(done.hold_force[i]), 4),
                "speed_m_s": rounded(float(done.speed[i]), 4),
                "angle_rad": rounded(float(done.angle[i]), 4),
                "separation_m": [
                    rounded(float(done.separation_y[i]), 4),
                    rounded(float(done.separation_z[i]), 4),
                ],
                "landing_m": rounded(float(done.landing_y[i]), 4),
            }
            for i, draw in enumerate(draws.tolist())
        ],
    }


def _readme(model: CalibratedBand, name: str, content: dict) -> str:
    kilo = f"{1e-3 * model.parameters.sample()['youngs_modulus']:.3g} kPa"
    history, after = content["history"], ""
    if history:
        after = " after a pull of {pull_time_s:.1f} s and a pause of {pause_s:.1f} s".format(
            **history
        )
    return f"""\
# {model.band.name} as plain numbers

`{name}` holds what an engine of your own needs. {about.FRAMES}

- `sizes`: what was weighed and measured. `clamp_direction` is that of the band as it leaves the tip
  at − x; it leaves the other tip along the mirror image.
- `values`: what was identified, {kilo} here. Nine of ten compatible values lie between `low` and
  `high`; null means fixed, or not known.
- `law`, `relaxation_times_s`: neo-Hookean, or rubber. Of rubber, a branch with each of these times
  carries its share of `relaxation`, which is that of a decade of time, times the stress besides.
- `curve`: first pull of the straight band by its stretch λ, after ten seconds:
  E A/3 (λ − λ⁻²)(1 − m + m/λ + c (λ² + 2/λ − 3)), with the section A, Mooney's share m and the
  upturn c. Up to a stretch that it has seen, a band is softer (`softening`).
- `launches`: what the calibrated simulation does{after}: the force to hold a draw, speed, angle and
  place where the projectile leaves the pouch, and the landing.

**Match, do not copy.** An engine has a mesh, a time step and a law of its own; with the same
numbers it does something else. Fit its stiffness until it holds the `hold_force_n` of `launches`,
then its damping until it lands at `landing_m`, and keep some launches back to check. Take a time
step that keeps the recoil's speed: backward Euler at 5 ms loses 14 to 21 % of it.

Nothing was simulated in another engine for this file.
"""
