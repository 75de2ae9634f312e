"""θ files: read as written, and every mistake in them is one line that names it."""

import json
from pathlib import Path

import numpy as np
import pytest

from sling2sim2real.base.errors import UserError
from sling2sim2real.identification.results.theta import (
    content_of,
    load_samples,
    load_theta,
    parameters_of,
)
from sling2sim2real.settings.identification import LAWS
from sling2sim2real.simulator.model import LaunchHistory
from sling2sim2real.simulator.parameters import THETA, Parameters

SOFT = dict(zip(THETA, (6e5, 0.45, 5e-3, 0.5, 1.0), strict=True))


def refusal(file: Path, text: str) -> str:
    file.write_text(text)
    with pytest.raises(UserError) as error:
        load_theta(file, "red")
    assert "\n" not in str(error.value)
    return str(error.value)


def test_what_is_no_json_object(tmp_path: Path) -> None:
    for text in ("[" * 200_000, "", "{", "1" * 5000):
        assert "cannot be read as JSON" in refusal(tmp_path / "theta.json", text)


def test_a_theta_file_comes_back_with_its_drag(tmp_path: Path) -> None:
    file = tmp_path / "theta.json"
    file.write_text(json.dumps({"band": "red", "theta": SOFT, "nuisances": {"air_drag": 2.5}}))
    parameters = parameters_of(load_theta(file, "red"))
    assert parameters.sample() == {**SOFT, "air_drag": 2.5, "turn_damping": 0, "returned_share": 1}
    assert parameters_of({"theta": SOFT}).column("air_drag").tolist() == [0.0]
    assert parameters_of(content_of(parameters)).values.tolist() == parameters.values.tolist()


def test_the_law_rubber_names_its_parameters(tmp_path: Path) -> None:
    file, rubber = (
        tmp_path / "theta.json",
        dict(zip(LAWS["rubber"], (0.3, 0.0, 0.1, 0.02, 0.2, 2.5), strict=True)),
    )
    history = {"pull_time": 4.0, "pause": 2.0, "deepest": 0.3}
    whole = {"band": "red", "law": "rubber", "theta": SOFT | rubber, "history": history}
    file.write_text(json.dumps(whole))
    content = load_theta(file, "red")
    parameters = parameters_of(content)
    assert parameters.values.tolist() == [[*SOFT.values(), *rubber.values(), 0.0, 0.0, 1.0]]
    assert parameters.theta.tolist() == [list(SOFT.values())]
    written = content_of(parameters, LaunchHistory(**history))
    assert (written["law"], written["theta"], written["history"]) == (
        "rubber",
        SOFT | rubber,
        history,
    )
    for change, message in (
        ({"theta": SOFT}, "theta: of the law rubber it must have exactly youngs_modulus"),
        ({"law": "neo_hookean"}, "theta: of the law neo_hookean it must have exactly"),
        ({"law": "gum"}, "law: must be"),
        ({"history": None}, "history: {pull_time, pause} is missing"),
        ({"history": {"pull_time": 0, "pause": 1}}, "history.pull_time: must be"),
    ):
        assert message in refusal(file, json.dumps(whole | change))


def test_samples_come_from_the_theta_stages_file(tmp_path) -> None:
    best = Parameters.of("neo_hookean", [*SOFT.values()], air_drag=0.7)
    path, samples = tmp_path / "none.json", np.linspace(0.1, 1, 15).reshape(3, 5)
    assert load_samples(path, best) is None
    content = {"names": list(THETA), "samples": samples.tolist()}
    path.write_text(json.dumps(content))
    parameters = load_samples(path, best)
    np.testing.assert_array_equal(parameters.theta, samples)
    assert parameters.column("air_drag").tolist() == [0.7] * 3  # as the best one, where it has none
    path.write_text('{"samples": []}')  # of a θ without confidence
    assert load_samples(path, best) is None
    with_drag = {"names": [*THETA, "air_drag"], "samples": [[0.5] * 6] * 4}
    path.write_text(json.dumps(with_drag))
    assert load_samples(path, best).column("air_drag").tolist() == [0.5] * 4
    with pytest.raises(UserError, match="none.json: names: must be those of the law rubber"):
        load_samples(path, Parameters.of("rubber", [*SOFT.values()]))
    path.write_text(json.dumps(content | {"names": with_drag["names"]}))
    with pytest.raises(UserError, match="samples: must have a column for each"):
        load_samples(path, best)
