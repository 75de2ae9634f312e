"""`sling plan`: frames, files, limits, bands to come."""

import csv
import json
import math
from pathlib import Path

import numpy as np
import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from scipy.spatial.transform import Rotation

from pipeline.params import Params, load
from sling2sim2real import Band, Identification, Settings, Theta
from sling2sim2real.api.identification import Fork
from sling2sim2real.base.errors import UserError
from sling2sim2real.cli.plan import limits
from sling2sim2real.cli.plan.force import Held, Prediction
from sling2sim2real.cli.plan.messages import COLUMNS
from sling2sim2real.cli.plan.plan import known_band, plan_recording
from sling2sim2real.settings.lab import Dip, Gripper
from tests.project import DEFAULTS, with_

pytestmark = pytest.mark.usefixtures("nowhere")

BAND = Band(mass=0.023, diameter=0.010, rest_length=0.52, name="band1")
FORK_IN_BASE = (0.7, 0.1, 0.4, 0.0, 0.0, -(0.5**0.5), 0.5**0.5)  # the target along the base's x


@pytest.fixture(scope="module")
def params() -> Params:
    """Without dips, of which tests bring their own."""
    return with_(with_(load(DEFAULTS), "setup", base_to_fork=FORK_IN_BASE), "plan", dips=())


@pytest.fixture(scope="module")
def plan(params):
    return plan_recording(params, BAND, draw=(-0.35, -0.1))


def dip(**values: float) -> Dip:
    return Dip(**({"at": 1.0, "depth": 0.1, "out_time": 1.0, "back_time": 1.0} | values))


def table(path: Path) -> tuple[dict[str, np.ndarray], list[str]]:
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    numbers = {name: np.array([float(r[name]) for r in rows]) for name in COLUMNS[:-1]}
    return numbers, [row["phase"] for row in rows]


def vectors(columns: dict[str, np.ndarray], names: str) -> np.ndarray:
    return np.stack([columns[name] for name in names.split()], axis=1)


def test_the_csv_is_the_trajectory_in_the_robots_base(plan, tmp_path) -> None:
    """Taken back to frame O by a matrix that is written out by hand."""
    columns, phases = table(plan.write(tmp_path, 50.0)[0])
    t = columns["t"]
    np.testing.assert_allclose(np.diff(t), 0.02, atol=1e-9)
    assert plan.trajectory.duration <= t[-1] < plan.trajectory.duration + 0.02
    to_base = np.array([[0.0, 1, 0, 0.7], [-1, 0, 0, 0.1], [0, 0, 1, 0.4], [0, 0, 0, 1]])
    back = np.linalg.inv(to_base)
    for names, derivative, weight in (("x y z", 0, 1.0), ("vx vy vz", 1, 0), ("ax ay az", 2, 0)):
        given = np.column_stack([vectors(columns, names), np.full(len(t), weight)]) @ back.T
        wanted = plan.trajectory.position(t, derivative)
        np.testing.assert_allclose(given[:, :3], wanted, atol=1e-7)
    hand = Rotation.from_quat(vectors(columns, "qx qy qz qw")).as_matrix()
    ahead = back[:3, :3] @ hand[0] @ [0, 0, 1]
    np.testing.assert_allclose(ahead, np.array([0, 0.35, 0.1]) / np.hypot(0.35, 0.1), atol=1e-8)
    fingers = back[:3, :3] @ hand[0] @ [0, 1, 0]
    assert fingers[0] == pytest.approx(0, abs=1e-8)  # they close across the band, which lies in x
    np.testing.assert_array_equal(hand, hand[:1].repeat(len(hand), 0))
    assert list(dict.fromkeys(phases)) == [phase.name for phase in plan.trajectory.phases]
    assert set(columns["opening"]) >= {0.08, 0.0}


def build(store, kind: str, content: object) -> object:
    """A rosbags message from JSON, field by field as the type's definition has them."""
    if kind not in store.types:  # a basic type
        return content
    values = {}
    for field, (node, detail) in store.get_msgdef(kind).fields:
        if node.name == "NAME":
            values[field] = build(store, detail, content[field])
        elif node.name == "BASE":
            values[field] = content[field]
        else:
            (inner, what), _ = detail
            name = what if inner.name == "NAME" else ""
            values[field] = [build(store, name, element) for element in content[field]]
    assert set(values) == set(content)
    return store.types[kind](**values)


def test_the_gripper_opens_closes_and_opens(plan, tmp_path) -> None:
    files = plan.write(tmp_path, 10.0)
    store = get_typestore(Stores.EMPTY)
    kind = "control_msgs/msg/GripperCommand"
    store.register(get_types_from_msg("float64 position\nfloat64 max_effort", kind))
    commands = json.loads(files[1].read_text())
    for command in commands:
        message = build(store, kind, command["command"])
        assert store.deserialize_cdr(store.serialize_cdr(message, kind), kind) == message
    positions = [row["command"]["position"] for row in commands]
    assert positions == [0.04, 0.0, 0.04]  # of each finger of a Franka's hand, which goes 0.04 m
    assert {row["command"]["max_effort"] for row in commands} == {40.0}
    stamps = [row["time_from_start"] for row in commands]
    times = [stamp["sec"] + stamp["nanosec"] * 1e-9 for stamp in stamps]
    content = json.loads(plan.to_json(files))
    assert times == pytest.approx([0.0, content["grasp_s"], content["release_s"]])


@pytest.mark.parametrize(
    ("position", "wanted"),
    [("finger", (0.04, 0.0)), ("gap", (0.08, 0.0)), ([0.0, 0.8], (0.0, 0.8)), ([85, 0], (85, 0))],
)
def test_other_grippers_take_other_numbers(position, wanted) -> None:
    """Robotiq's angle of the knuckle grows while it closes."""
    gripper = Gripper(open=0.08, closed=0.0, position=position)
    assert (gripper.command(0.08), gripper.command(0.0)) == pytest.approx(wanted)


@pytest.mark.parametrize("position", ["width", [0.1, 0.1], [0, math.nan]])
def test_a_position_that_is_none_is_refused(position) -> None:
    text = DEFAULTS.read_text()
    wrong = text.replace("position: finger}", f"position: {json.dumps(position)}}}")
    with pytest.raises(UserError, match=r"plan.gripper.position: must be finger, gap, or its numb"):
        Params.parse(wrong)


def test_without_a_base_the_plan_is_in_frame_o_and_says_so(params, tmp_path) -> None:
    unknown = with_(params, "setup", base_to_fork=None)
    plan = plan_recording(unknown, BAND, draw=(-0.35, -0.1))
    files = plan.write(tmp_path, 10.0)
    columns, _ = table(files[0])
    times = columns["t"]
    np.testing.assert_allclose(
        vectors(columns, "x y z"), plan.trajectory.position(times), atol=1e-9
    )
    assert json.loads(files[2].read_text())["frame"] == "fork"
    content = json.loads(plan.to_json(files))
    assert (content["frame"], content["base_to_fork"]) == ("fork", None)
    assert content["base_to_fork_source"] is None
    output = next(line for line in plan.to_text(files).splitlines() if line.startswith("fork  "))
    assert "nothing says where it stands in the robot's base, so all is in frame O" in output
    turned = with_(unknown, "plan", orientation=(0.0, 0.0, 0.0, 1.0))
    with pytest.raises(UserError, match="plan.orientation is the hand's in the robot's base"):
        plan_recording(turned, BAND)


@pytest.mark.parametrize(
    ("section", "values", "expected"),
    [
        (
            "plan",
            {"draw": (-0.6, 0.0)},
            "y = -0.6 m lies 0.15 m beyond the -0.45 m of setup.draw",
        ),
        ("plan", {"draw": (-1e-300, 0.0)}, "draw by 0.251 m at least, not 0.000 m"),
        ("plan", {"floor_clearance": 0.4}, "0.318 m above the floor, 0.082 m less than plan.floor"),
        ("plan", {"orientation": (0.5, 0.5, 0.5, -0.5)}, "plan.orientation: the fingers (z) would"),
        (
            "plan",
            {"gripper": Gripper(open=0.009, closed=0.0, position="finger")},
            "plan.gripper.open: 0.009 m is no wider than the band, 0.01 m thick",
        ),
        ("episode", {"longest": 7.0}, "it takes 7.71 s, 1.51 s more than episode.longest 7 less"),
        ("plan", {"pull_speed": 0.05}, "raise plan.pull_speed, or raise episode.longest to "),
        ("plan", {"dips": (dip(depth=0.4),)}, "dip 1 lets the band back by 0.4 m from 0.4 m, and"),
        ("plan", {"dips": (dip(out_time=0.4),)}, "the let back (plan.dips) reaches 0.5 m/s, 0.1"),
    ],
)
def test_what_is_refused_and_how_it_is_said(params, section, values, expected) -> None:
    with pytest.raises(UserError) as error:
        plan_recording(with_(params, section, **values), BAND)
    assert expected in str(error.value) and "\n" not in str(error.value)


def test_the_advice_of_a_refusal_is_enough(params) -> None:
    """With what the line says, and nothing else changed, the plan is accepted."""
    plan_recording(with_(params, "plan", pull_speed=0.052), BAND)
    slow = with_(params, "plan", pull_speed=0.05)
    plan_recording(with_(slow, "episode", longest=20.6), BAND)
    with pytest.raises(UserError, match=r"draw by 0.251 m at least, not 0.200 m"):
        plan_recording(params, BAND, draw=(-0.2, 0.0))
    plan_recording(params, BAND, draw=(-0.252, 0.0))


def test_the_informative_pull_is_the_default(params, tmp_path) -> None:
    dips = with_(params, "plan", dips=(dip(), dip(at=0.7)))
    plan, paper = (plan_recording(dips, BAND, pull=pull) for pull in ("informative", "paper"))
    assert plan_recording(dips, BAND).about == plan.about
    assert paper.about == {**plan_recording(params, BAND).about, "pull": "paper"}
    names = [row["phase"] for row in plan.about["phases"]]
    assert (names.count("let back"), names.count("redraw"), plan.about["dips"]) == (2, 2, 2)
    assert plan.about["held_s"] == pytest.approx(paper.about["held_s"] + 4.0, abs=1e-6)
    assert "informative, with 2 dips" in plan.to_text([])
    assert "paper, with 0 dips" in paper.to_text([])
    assert len(plan.write(tmp_path, 100.0)) == 3


def test_a_held_string_pulls_as_its_formula() -> None:
    """Half the fork 3, drawn by 4: each half is 5 long and gives 4/5 of its tension."""
    held = Held(half_width=3.0, rest_length=8.0)
    point = np.array([0.0, -4.0, 0.0])
    assert held.stretch(point) == pytest.approx(1.25)
    assert held.force(point) == pytest.approx(2 * 4 / 5 * (1.25 - 1 / 1.25**2))
    assert held.force(0.5 * point) == held.force(np.zeros(3)) == 0
    part = held.reach(held.stretch, 1.1, point)
    assert held.stretch(part * point) == pytest.approx(1.1)


def test_the_force_by_theta(params) -> None:
    theta = Theta(3e5, 0.45, 5e-3, 0.5, 1.0)
    settings = Settings.default()
    found = Identification(BAND, theta, settings=settings)
    held = float(found.launches((-0.3, -0.2)).hold_force[0])
    planned = plan_recording(params, BAND, draw=(-0.3, -0.2), found=found)
    assert planned.about["hold_force_n"] == held

    weak = with_(params, "setup", max_force=held - 1)
    with pytest.raises(UserError, match="1.0 N more than setup.max_force") as error:
        plan_recording(weak, BAND, draw=(-0.3, -0.2), found=found)
    advised = tuple(map(float, str(error.value).split("--draw=")[1].split(",")))
    enough = plan_recording(weak, BAND, draw=advised, found=found)
    assert enough.about["hold_force_n"] < held - 1


def test_a_band_that_the_arm_cannot_hold(params) -> None:
    held, drawn = Held.of(BAND, params.setup), np.array([0.0, -0.4, 0.0])
    with pytest.raises(UserError, match="900.0 N .* the band is too stiff for this arm"):
        limits.check_force(params.setup, held, drawn, Prediction(900.0, "said"))


def test_a_band_to_come_is_planned_by_its_sizes(params, fitted, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    longer = known_band(None, {"mass": 0.04, "diameter": 0.02, "rest_length": 0.6})
    assert longer.band.name == "new" and longer.found is None
    stretches = (plan_recording(params, b).about["stretch"] for b in (longer.band, BAND))
    assert next(stretches) < next(stretches)
    assert known_band(None, {"rest_length": 0.6}).band.diameter == 0.010  # the usual one
    monkeypatch.chdir(fitted)
    known = known_band(Path("bands/toy"), {})
    assert known.band.name == "toy" and known.found


def test_where_the_fork_was_identified_it_stands(params) -> None:
    unknown = with_(params, "setup", base_to_fork=None)
    fork = Fork(pose=FORK_IN_BASE, frame="arm")
    found = Identification(BAND, Theta(3e5, 0.45, 5e-3, 0.5, 1.0), fork=fork)
    plan = plan_recording(unknown, BAND, draw=(-0.35, -0.1), found=found)
    known = plan_recording(params, BAND, draw=(-0.35, -0.1))
    assert plan.about["frame"] == "arm"
    np.testing.assert_allclose(plan.base.translation, known.base.translation)
