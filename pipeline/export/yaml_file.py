"""All that is known of a band as one YAML file, for an engine that none of the targets is."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
from ruamel.yaml import YAML

from pipeline.base.files import write_text
from pipeline.episode.episode import Episode
from pipeline.export import values as export_values
from pipeline.export.band import CalibratedBand
from pipeline.export.card import readme
from pipeline.export.match import draws_of
from pipeline.report.quantities import rounded
from pipeline.simulator.rubber import RUBBER, TIMES, uniaxial

STRETCHES = np.arange(1.0, 2.21, 0.1)


def to_yaml(model: CalibratedBand, folder: Path, episode: Episode | None) -> dict:
    """<band>.yaml, and README.md: how to read it."""
    name, numbers = f"{model.band.name}.yaml", content_of(model)
    files = {name: "values, curve, launches", "README.md": "how to read it"}
    content = {"band": model.band.name, "target": "yaml", "files": files, **numbers}
    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style = None
    yaml.sort_base_mapping_type_on_output = False  # pyright: ignore[reportAttributeAccessIssue]
    yaml.width = 100
    stream = io.StringIO()
    yaml.dump(numbers, stream)
    write_text(folder / name, f"# {READ_ME}\n{stream.getvalue()}")
    write_text(folder / "README.md", readme(content))
    return content


READ_ME = (
    "An identified band. README.md says how to read it; low and high: nine of ten lie between."
)


def content_of(model: CalibratedBand) -> dict:
    """What the file holds."""
    parameters, (draws, done) = model.parameters, draws_of(model)
    theta = parameters.sample()
    shape = theta.get("mooney_share", 0.0), theta.get("upturn", 0.0)
    strength = theta["youngs_modulus"] * np.pi * model.band.diameter**2 / 4
    return {
        "frames": export_values.FRAMES,
        "sizes": export_values.sizes(model),
        "law": parameters.law,
        "values": export_values.values(model),
        "relaxation_times_s": TIMES.tolist() if parameters.law == RUBBER else [],
        "history": export_values.history(model),
        "curve": {
            "stretch": [rounded(value, 4) for value in STRETCHES.tolist()],
            "pull_n": [rounded(value, 5) for value in (strength / 3 * uniaxial(STRETCHES, *shape))],
        },
        "launches": [
            {
                "draw_m": [rounded(coordinate, 6) for coordinate in draw],
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
