"""Choose θ* from everything that a search evaluated.

    python -m stages.theta band1-paper

Reads data/evaluations/ and data/confidence/ of the pair; writes data/theta/<pair>.json, and for
`dvc metrics diff` and `dvc exp show` its loss and stiffness into reports/theta/<pair>.json.
θ* is the mode of the density where one was fitted, which alone says how sure θ* is; else it is the
best of all evaluations, and "confidence" is null.
"""

from __future__ import annotations

from pipeline.layout import Layout
from sling2sim2real.base.files import made, write_json
from sling2sim2real.base.parameters import TABLE
from sling2sim2real.identification.results.evaluations import TERMS, Evaluations, theta_content
from sling2sim2real.identification.results.theta import load_confidence
from stages.start import pair_of_stage, run

DIGITS = 4  # of metrics: another kind of CPU differs beyond them


def metrics(content: dict) -> dict[str, float]:
    """Loss of the paper and Young's modulus of a θ file's content, whatever the method."""
    modulus = next(row for row in TABLE if row.name == "youngs_modulus")
    values = {
        "loss": sum(content["loss"].get(term, float("nan")) for term in TERMS),
        f"E_{modulus.unit}": modulus.factor * content["theta"][modulus.name],
    }
    return {k: float(f"{v:.{DIGITS}g}") for k, v in values.items() if v == v}


def main() -> None:
    (_, pair), layout = pair_of_stage(), Layout()
    evaluations = Evaluations.load(pair.method, made(layout.evaluations(pair)))
    content = theta_content(evaluations, pair.band, load_confidence(layout.confidence(pair)))
    write_json(layout.theta(pair), content)
    write_json(layout.metrics(pair), {pair.key: metrics(content)})
    print(f"{pair.key}: loss {content['loss']['total']:.5g}")


if __name__ == "__main__":
    run(main)
