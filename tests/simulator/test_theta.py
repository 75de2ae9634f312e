"""θ files: read as written, and every mistake in them is one line that names it."""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from pipeline.base.errors import UserError
from pipeline.identify.results.theta import at_points, load_samples, load_theta, point, vector
from pipeline.simulator.material import THETA

SOFT = dict(zip(THETA, (6e5, 0.45, 5e-3, 0.5, 1.0), strict=True))


def refusal(file: Path, text: str) -> str:
    file.write_text(text)
    with pytest.raises(UserError) as error:
        load_theta(file, "red")
    assert "\n" not in str(error.value)
    return str(error.value)


def test_a_theta_file_comes_back(tmp_path: Path) -> None:
    file = tmp_path / "theta.json"
    file.write_text(json.dumps({"band": "red", "theta": SOFT}))
    assert vector(load_theta(file, "red")).tolist() == list(SOFT.values())


def test_values_out_of_range_are_named(tmp_path: Path) -> None:
    wrong = {
        "youngs_modulus": [0, 10**400],
        "poissons_ratio": [0.5, -0.1],
        "elasticity_damping": [10.0],
        "dynamic_friction": [50, float("nan")],
        "damping_scale": [1.01, True, "1"],
    }
    for name, value in ((name, value) for name, values in wrong.items() for value in values):
        text = json.dumps({"band": "red", "theta": SOFT | {name: value}})
        message = refusal(tmp_path / "theta.json", text)
        assert f"theta.{name}: must be " in message and "between" in message and len(message) < 300


def test_what_is_no_json_object(tmp_path: Path) -> None:
    for text in ("[" * 200_000, "", "{", "1" * 5000):
        assert "cannot be read as JSON" in refusal(tmp_path / "theta.json", text)


def test_the_drag_comes_back_and_the_sling_gets_it(tmp_path: Path) -> None:
    file = tmp_path / "theta.json"
    said = {"air_drag": 2.5}
    file.write_text(json.dumps({"band": "red", "theta": SOFT, "nuisances": said}))
    assert load_theta(file, "red")["nuisances"] == said
    sling, theta = at_points(Windless(), np.array([[1.0, 2, 3, 4, 5, 0.7], [1.0, 2, 3, 4, 5, 0.9]]))
    assert theta.tolist() == [[1, 2, 3, 4, 5]] * 2
    np.testing.assert_array_equal(sling.air_drag, [0.7, 0.9])
    assert at_points(Windless(), theta)[0].air_drag == 0.0


@dataclass(frozen=True)
class Windless:
    air_drag: float = 0.0
    law: str = "neo_hookean"
    mooney_share: float = 0.0
    relaxation: float = 0.0


def test_the_law_rubber_names_its_parameters(tmp_path: Path) -> None:
    file, rubber = tmp_path / "theta.json", {"mooney_share": 0.3, "relaxation": 0.02}
    history = {"pull_time": 4.0, "pause": 2.0}
    whole = {"band": "red", "law": "rubber", "theta": SOFT | rubber, "history": history}
    file.write_text(json.dumps(whole))
    content = load_theta(file, "red")
    assert point(content).tolist() == [*SOFT.values(), 0.3, 0.02]
    assert vector(content).tolist() == list(SOFT.values())
    points = np.array([[*range(1, 6), 0.2, 0.01, 0.7]])
    sling, theta = at_points(Windless(law="rubber"), points)
    assert theta.tolist() == [[1, 2, 3, 4, 5]]
    assert (sling.mooney_share, sling.relaxation, sling.air_drag) == (0.2, 0.01, 0.7)
    for change, message in (
        ({"theta": SOFT}, "theta: of the law rubber it must have exactly youngs_modulus"),
        ({"law": "neo_hookean"}, "theta: of the law neo_hookean it must have exactly"),
        ({"law": "gum"}, "law: must be"),
        ({"history": None}, "history: {pull_time, pause} is missing"),
        ({"history": {"pull_time": 0, "pause": 1}}, "history.pull_time: must be"),
    ):
        assert message in refusal(file, json.dumps(whole | change))


def test_bad_nuisances_are_one_line(tmp_path: Path) -> None:
    for said, message in (
        ({"drag": 1.0}, "nuisances.drag: unknown key, the closest known one is air_drag"),
        ([1.0], "nuisances: must be a mapping"),
        (None, "nuisances: must be a mapping"),
        ({"air_drag": -1}, "nuisances.air_drag: must be between 0 and 50, got -1"),
        ({"air_drag": float("nan")}, "nuisances.air_drag: must be between"),
        ({"air_drag": float("inf")}, "nuisances.air_drag: must be between"),
        ({"air_drag": True}, "nuisances.air_drag: must be a number between 0 and 50"),
        ({"camera_delay": 0.001}, "nuisances.camera_delay: unknown key"),
    ):
        text = json.dumps({"band": "red", "theta": SOFT, "nuisances": said})
        assert message in refusal(tmp_path / "theta.json", text)


def test_samples_come_from_the_theta_stages_file(tmp_path) -> None:
    path, samples = tmp_path / "none.json", np.linspace(0.1, 1, 15).reshape(3, 5)
    assert load_samples(path) is None
    content = {"names": list(THETA), "samples": samples.tolist()}
    path.write_text(json.dumps(content))
    np.testing.assert_array_equal(load_samples(path), samples)
    path.write_text('{"samples": []}')  # of a θ without confidence
    assert load_samples(path) is None
    with_drag = {"names": [*THETA, "air_drag"], "samples": [[0.5] * 6] * 4}
    path.write_text(json.dumps(with_drag))
    assert load_samples(path).shape == (4, 6)
    path.write_text(json.dumps(content | {"names": with_drag["names"]}))
    with pytest.raises(UserError, match="samples: must have a column for each"):
        load_samples(path)
    for damaged in ("{", "[]", json.dumps(content | {"names": ["a"]}), '{"names": []}'):
        path.write_text(damaged)
        with pytest.raises(UserError, match="none.json: "):
            load_samples(path)
