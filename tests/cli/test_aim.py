"""Aiming with a toy policy: the closed form says where the draw lands."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

from sling2sim2real.base.errors import UserError
from sling2sim2real.cli.aim import aim, why_refused
from sling2sim2real.launching.surface.stored import Stored
from sling2sim2real.simulator.parameters import THETA
from tests.policy import toy
from tests.policy.linear import write_policy

PARAMS = SimpleNamespace(
    bands={"toy": SimpleNamespace(rest_length=toy.REST_LENGTH)},
    run=SimpleNamespace(
        bands=["toy"],
        methods=["none", "other"],
        own=[],
        ablations=SimpleNamespace(bands=[], methods=[]),
        dips=[],
    ),
    methods={"none": None, "other": None},
    policy=SimpleNamespace(targets=(1.425, 2.425)),
    trials=SimpleNamespace(actuation_error=0.001),
    setup=SimpleNamespace(
        max_force=15.0, fork_width=toy.FORK_WIDTH, draw_y=toy.DRAW_Y, draw_z=toy.DRAW_Z
    ),
    launch=SimpleNamespace(pull_time=None, pause=None),
)

ALWAYS = {"stretch", "confidence", "params", "mounting"}  # of a project with little in it


@pytest.fixture(scope="module")
def root(tmp_path_factory):
    """A policy that hits 1.925 m and lands near its other targets."""
    root = tmp_path_factory.mktemp("root")
    along = np.linspace(*toy.DRAW_Y, 1001)
    landing = toy.launch(np.column_stack([along, np.full(1001, -0.15)])).landing_y
    short, far = np.interp([1.925, 2.425], landing[::-1], along[::-1])
    slope = (far - short) / 0.5
    write_policy(
        root / "data/policies/toy/none/policy.onnx", (slope, 0), (short - 1.925 * slope, -0.15)
    )
    file = root / "data/theta/toy/none.json"
    file.parent.mkdir(parents=True)
    theta = dict.fromkeys(THETA, 0.4) | {"youngs_modulus": 4e5}
    file.write_text(json.dumps({"band": "toy", "theta": theta}))
    return root


def shoot(root, target: float, launcher=toy.launch, **settings) -> dict:
    params = SimpleNamespace(**{**vars(PARAMS), **settings})
    return aim(params, "toy", "none", target, root, launcher=launcher)


def abouts(answer) -> set[str]:
    return {warning.about for warning in answer["warnings"]}


def test_the_draw_lands_on_the_target(root) -> None:
    answer = shoot(root, 1.925)
    draw = np.array([[answer["draw_y_m"], answer["draw_z_m"]]])
    truth = toy.launch(draw)
    assert truth.landing_y[0] == pytest.approx(1.925, abs=0.02)
    assert answer["predicted_landing_m"] == pytest.approx(truth.landing_y[0], abs=1e-6)
    assert answer["hold_force_n"] == pytest.approx(truth.hold_force[0], abs=1e-6)
    assert answer["max_force_n"] == 15.0
    assert abouts(answer) == ALWAYS and why_refused(answer) is None
    again = Stored("toy", "none", root).draws([1.925])
    np.testing.assert_allclose(again, draw)


def test_nine_landings_of_ten_lie_in_the_interval(root) -> None:
    answer = shoot(root, 1.925)
    draw = np.array([answer["draw_y_m"], answer["draw_z_m"]])
    spread = draw + np.random.default_rng(0).normal(0, 0.001, (4000, 2))
    low, high = answer["interval_90_m"]
    landing = toy.launch(spread).landing_y
    assert 0.88 < ((landing > low) & (landing < high)).mean() < 0.92


def test_what_is_known_of_theta_widens_the_interval(root) -> None:
    """Samples whose landings spread by a tenth: nine of ten of those lie inside."""

    def launcher(draws, parameters=None):
        launched = toy.launch(draws)
        if parameters is not None:
            launched.landing_y = launched.landing_y * parameters.values[:, 0]
        return launched

    narrow = shoot(root, 1.925)["interval_90_m"]
    spread = np.linspace(0.9, 1.1, 201)
    file = root / "data/confidence/toy/none.json"
    file.parent.mkdir(parents=True)
    samples = np.tile(spread[:, None], (1, len(THETA))).tolist()
    file.write_text(json.dumps({"names": list(THETA), "samples": samples}))
    answer = shoot(root, 1.925, launcher=launcher)
    file.unlink()
    landing = answer["predicted_landing_m"]
    assert abouts(answer) == ALWAYS
    np.testing.assert_allclose(answer["interval_90_m"], [0.91 * landing, 1.09 * landing], rtol=0.01)
    assert np.ptp(narrow) < 0.5 * np.ptp(answer["interval_90_m"])


def test_says_the_pull_and_pause_that_rubber_takes_for_granted(root) -> None:
    """The recording's, but for what params.yaml asks of a launch."""
    file = root / "data/theta/toy/none.json"
    before = file.read_text()
    theta = json.loads(before)["theta"] | {
        "mooney_share": 0.3,
        "upturn": 0.0,
        "softening": 0.0,
        "relaxation": 0.02,
        "flow": 0.1,
        "log_flow_rate": 2.0,
    }
    history = {"pull_time": 4.0, "pause": 2.0}
    rubber = {"band": "toy", "law": "rubber", "theta": theta, "history": history}
    plain = shoot(root, 1.925)
    file.write_text(json.dumps(rubber))
    answer = shoot(root, 1.925, launch=SimpleNamespace(pull_time=None, pause=5.0))
    file.write_text(before)
    assert answer == plain | {"pull_and_pause_s": [4.0, 5.0]}


def test_warns_outside_the_trained_range_and_refuses_above_the_force(root) -> None:
    assert "target" in abouts(shoot(root, 2.7)) and "target" not in abouts(shoot(root, 2.4))
    weak = SimpleNamespace(**{**vars(PARAMS.setup), "max_force": 1.0})
    answer = shoot(root, 1.925, setup=weak)
    assert "force" in abouts(answer) and "more than setup.max_force" in str(why_refused(answer))


def test_a_draw_that_misses_by_more_than_5_cm_is_to_be_refused(root) -> None:
    for off, refused in ((0.04, False), (0.07, True)):

        def beside(draws: np.ndarray, off: float = off):
            launched = toy.launch(draws)
            launched.landing_y = launched.landing_y + off
            return launched

        answer = shoot(root, 1.925, launcher=beside)
        assert ("miss" in abouts(answer)) is refused is (why_refused(answer) is not None)


def test_a_failed_launch_has_no_prediction_and_failures_beside_it_no_interval(root) -> None:
    for most, lands, warning in ((0, False, "failure"), (1, True, "interval")):

        def broken(draws: np.ndarray):
            launched = toy.launch(draws)
            failed = len(draws) > most  # noqa: B023
            launched.failure = ["it broke" if failed else None] * len(draws)
            return launched

        answer = shoot(root, 1.925, launcher=broken)
        assert (answer["predicted_landing_m"] is not None) is lands
        assert answer["interval_90_m"] is None and warning in abouts(answer)
        assert (why_refused(answer) is None) is lands


def test_says_what_is_missing(root) -> None:
    for band, method, message in (
        ("none", "none", "band none: not in params.yaml, which has toy"),
        ("toy", "missing", "method missing: not in params.yaml"),
        ("toy", "other", "data/theta/toy/other.json: missing"),
    ):
        with pytest.raises(UserError, match=message):
            aim(PARAMS, band, method, 1.925, root, launcher=toy.launch)
