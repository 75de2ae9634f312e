"""Train, check and export the slingshot policy of one band and method.

    python -m stages.policy band1 sling2sim2real

Reads data/theta/<band>/<method>.json; writes data/policies/<band>/<method>/: policy.onnx and
policy.pt (metres to metres), card.json, map.parquet (the simulated launches) and training.parquet.
"""

from __future__ import annotations

from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from pipeline import errors
from pipeline.files import replacing, write_json
from pipeline.policy.aim import simulator
from pipeline.policy.export import card, write_onnx, write_torchscript
from pipeline.policy.landing_map import LandingMap
from pipeline.policy.train import train
from pipeline.stage import started
from pipeline.theta import load_theta


def main() -> None:
    params, band, method = started("band", "method")
    theta = load_theta(Path("data/theta", band, f"{method}.json"), band)
    folder = Path("data/policies", band, method)

    landing_map = LandingMap.simulate(
        simulator(params, band, theta),
        draw_y=params.setup.draw_y,
        draw_z=params.setup.draw_z,
        size=params.policy.map_size,
        max_force=params.setup.max_force,
        seed=params.policy.seed,
    )
    trained = train(landing_map, params.policy)

    landing_map.save(folder / "map.parquet", {"band": band, "method": method})
    with replacing(folder / "training.parquet") as temporary:
        pq.write_table(pa.table(trained.curve), temporary)
    write_onnx(trained.policy, folder / "policy.onnx")
    write_torchscript(trained.policy, folder / "policy.pt")
    content = card(
        trained,
        band=band,
        method=method,
        theta=theta["theta"],
        targets=params.policy.targets,
        max_force=params.setup.max_force,
        map_error=landing_map.validation(params.policy.targets),
    )
    write_json(folder / "card.json", content)
    state = "converged" if trained.converged else "NOT converged"
    print(
        f"{band} {method}: {state}, mean |y_p - g| {100 * trained.mean_error:.2f} cm,"
        f" {trained.failed_targets} targets fail"
    )


if __name__ == "__main__":
    errors.run(main)
