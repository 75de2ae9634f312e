"""`sling plan`: frames, files, limits, and that a robot which follows it makes a good recording."""

import csv
import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from scipy.interpolate import CubicHermiteSpline
from scipy.spatial.transform import Rotation

from app.plan import limits
from app.plan.force import Earlier, Held, predict, read_earlier
from app.plan.messages import COLUMNS
from app.plan.plan import plan_recording, with_band
from app.plan.trajectory import Phase, Trajectory
from pipeline.base.errors import UserError
from pipeline.params import Params, load
from pipeline.recording.input.reader import read_recording
from tests.project import ROOT, with_
from tests.recording.bag import BASE, HAND, REST, Truth, write_bag

FORK_IN_BASE = (0.7, 0.1, 0.4, 0.0, 0.0, -(0.5**0.5), 0.5**0.5)  # the target along the base's x


@pytest.fixture(scope="module")
def params() -> Params:
    return with_(load(ROOT / "params.yaml"), "setup", base_to_fork=FORK_IN_BASE)


@pytest.fixture(scope="module")
def plan(params):
    return plan_recording(params, "band1", draw=(-0.35, -0.1))


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
    for names, derivative, one in (("x y z", 0, 1.0), ("vx vy vz", 1, 0), ("ax ay az", 2, 0)):
        given = np.column_stack([vectors(columns, names), np.full(len(t), one)]) @ back.T
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
            values[field] = [build(store, name, one) for one in content[field]]
    assert set(values) == set(content)
    return store.types[kind](**values)


def test_the_waypoints_are_a_ros_message_and_the_whole_plan(plan, tmp_path) -> None:
    """Serialised by rosbags; cubics between its points give back every sample of the CSV."""
    files = plan.write(tmp_path, 100.0)
    store = get_typestore(Stores.ROS2_HUMBLE)
    kind = "trajectory_msgs/msg/MultiDOFJointTrajectory"
    message = build(store, kind, json.loads(files[1].read_text()))
    read = store.deserialize_cdr(store.serialize_cdr(message, kind), kind)
    assert (read.header.frame_id, read.joint_names) == ("base", ["tcp"])

    stamps = [p.time_from_start for p in read.points]
    times = np.array([stamp.sec + stamp.nanosec * 1e-9 for stamp in stamps])
    np.testing.assert_allclose(times, plan.trajectory.path.x, atol=1e-9)
    places = [p.transforms[0].translation for p in read.points]
    speeds = [p.velocities[0].linear for p in read.points]
    spline = CubicHermiteSpline(
        times, [[p.x, p.y, p.z] for p in places], [[v.x, v.y, v.z] for v in speeds]
    )
    columns, _ = table(files[0])
    inside = columns["t"] <= times[-1]
    at = columns["t"][inside]
    np.testing.assert_allclose(spline(at), vectors(columns, "x y z")[inside], atol=1e-7)
    accelerations = [p.accelerations[0].linear for p in read.points]
    np.testing.assert_allclose(
        [[a.x, a.y, a.z] for a in accelerations[:-1]], spline(times[:-1], 2), atol=1e-5
    )
    turned = read.points[0].transforms[0].rotation
    np.testing.assert_allclose([turned.x, turned.y, turned.z, turned.w], plan.hand, atol=1e-12)


def test_the_gripper_opens_closes_and_opens(plan, tmp_path) -> None:
    files = plan.write(tmp_path, 10.0)
    store = get_typestore(Stores.EMPTY)
    kind = "control_msgs/msg/GripperCommand"
    store.register(get_types_from_msg("float64 position\nfloat64 max_effort", kind))
    commands = json.loads(files[2].read_text())
    for one in commands:
        message = build(store, kind, one["command"])
        assert store.deserialize_cdr(store.serialize_cdr(message, kind), kind) == message
    assert [one["command"]["position"] for one in commands] == [0.08, 0.0, 0.08]
    assert {one["command"]["max_effort"] for one in commands} == {40.0}
    stamps = [one["time_from_start"] for one in commands]
    times = [stamp["sec"] + stamp["nanosec"] * 1e-9 for stamp in stamps]
    content = json.loads(plan.to_json(files))
    assert times == pytest.approx([0.0, content["grasp_s"], content["release_s"]])


def test_what_is_printed(plan, tmp_path) -> None:
    text = plan.to_text([tmp_path / "a.csv"])
    assert f"wrote {tmp_path / 'a.csv'}" in text
    assert "not checked: no θ file and no recording was given" in text
    content = json.loads(plan.to_json([tmp_path / "a.csv"]))
    assert content["files"] == [str(tmp_path / "a.csv")]
    assert content["base_to_fork"] == pytest.approx(FORK_IN_BASE)
    pull = next(row for row in content["phases"] if row["phase"] == "pull")
    assert pull["fork"] == [0.0, -0.35, -0.1]
    assert pull["base"] == pytest.approx([0.35, 0.1, 0.3])
    assert pull["max_speed_m_s"] == pytest.approx(0.2, rel=1e-3)


def test_nothing_is_written_where_it_cannot_be(plan, tmp_path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(UserError, match="cannot be written"):
        plan.write(tmp_path / "file", 100.0)
    with pytest.raises(UserError, match="--rate: must be between 1 and 10000 Hz"):
        plan.write(tmp_path / "new", 1e9)
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


@pytest.mark.parametrize(
    ("section", "values", "expected"),
    [
        ("setup", {"base_to_fork": None}, "setup.base_to_fork is null"),
        (
            "plan",
            {"draw": (-0.6, 0.0)},
            "y = -0.6 m lies 0.15 m beyond the -0.45 m of setup.draw",
        ),
        ("plan", {"draw": (-0.3, -0.4)}, "z = -0.4 m lies 0.1 m beyond the -0.3 m of setup.draw_z"),
        ("plan", {"draw": (-0.3, 0.5)}, "z = 0.5 m lies 0.5 m beyond the 0 m of setup.draw_z"),
        ("plan", {"draw": (-1e-300, 0.0)}, "draw by 0.251 m at least, not 0.000 m"),
        ("plan", {"draw": (-0.2, 0.0)}, "stretches the band to 0.93 of its rest length"),
        ("plan", {"floor_clearance": 0.4}, "0.318 m above the floor, 0.082 m less than plan.floor"),
        ("plan", {"orientation": (0.5, 0.5, 0.5, -0.5)}, "plan.orientation: the fingers (z) would"),
        ("bands", None, "plan.gripper.open: 0.08 m is no wider than the band, 0.09 m thick"),
        ("episode", {"duration": 7.0}, "it takes 7.71 s, 1.51 s more than episode.duration 7 less"),
        (
            "plan",
            {"pull_speed": 0.15},
            "raise plan.pull_speed to 0.179, or episode.duration to ",
        ),
    ],
)
def test_what_is_refused_and_how_it_is_said(params, section, values, expected) -> None:
    if section == "bands":
        values = {"band1": params.bands["band1"].model_copy(update={"diameter": 0.09})}
        changed = params.model_copy(update={"bands": values})
    else:
        changed = with_(params, section, **values)
    with pytest.raises(UserError) as error:
        plan_recording(changed, "band1")
    assert expected in str(error.value) and "\n" not in str(error.value)


def test_the_advice_of_a_refusal_is_enough(params) -> None:
    """With what the line says, and nothing else changed, the plan is accepted."""
    plan_recording(with_(params, "plan", pull_speed=0.179), "band1")
    slow = with_(params, "plan", pull_speed=0.15)
    plan_recording(with_(slow, "episode", duration=9.9), "band1")
    with pytest.raises(UserError, match=r"draw by 0.251 m at least, not 0.200 m"):
        plan_recording(params, "band1", draw=(-0.2, 0.0))
    plan_recording(params, "band1", draw=(-0.252, 0.0))


def test_speed_and_acceleration_of_any_trajectory(params) -> None:
    """A leg of 0.4 m in 1 s reaches 0.8 m/s and 3.2 m/s^2."""
    leg = [Phase("lift", np.array([0.0, 0.0, 0.4]), 1.0, 0.0)]
    fast = Trajectory.through(np.zeros(3), 0.0, leg)
    with pytest.raises(UserError, match=r"lift reaches 0.8 m/s, 0.4 more than plan.max_speed 0.4"):
        limits.check_motion(fast, params.plan)
    loose = params.plan.model_copy(update={"max_speed": 0.8})
    with pytest.raises(UserError, match=r"lift reaches 3.2 m/s\^2, 1.2 more than plan.max_acc"):
        limits.check_motion(fast, loose)
    limits.check_motion(fast, loose.model_copy(update={"max_acceleration": 3.2}))


def test_a_held_string_pulls_as_its_formula() -> None:
    """Half the fork 3, drawn by 4: each half is 5 long and gives 4/5 of its tension."""
    held = Held(half_width=3.0, rest_length=8.0)
    point = np.array([0.0, -4.0, 0.0])
    assert held.stretch(point) == pytest.approx(1.25)
    assert held.force(point) == pytest.approx(2 * 4 / 5 * (1.25 - 1 / 1.25**2))
    assert held.force(0.5 * point) == held.force(np.zeros(3)) == 0
    part = held.reach(held.stretch, 1.1, point)
    assert held.stretch(part * point) == pytest.approx(1.1)


def test_the_force_by_theta(params, tmp_path) -> None:
    from pipeline.sling.launch import launch
    from pipeline.sling.load import load_sling
    from pipeline.sling.material import THETA

    values = 3e5, 0.45, 5e-3, 0.5, 1.0
    path = tmp_path / "theta.json"
    theta = dict(zip(THETA, values, strict=True))
    path.write_text(json.dumps({"band": "band1", "theta": theta}))
    held = float(launch(load_sling(params, "band1"), np.array(values), (-0.3, -0.2)).hold_force[0])
    planned = plan_recording(params, "band1", draw=(-0.3, -0.2), theta=path)
    assert planned.force.force == held

    weak = with_(params, "setup", max_force=held - 1)
    with pytest.raises(UserError, match="1.0 N more than setup.max_force") as error:
        plan_recording(weak, "band1", draw=(-0.3, -0.2), theta=path)
    advised = tuple(map(float, str(error.value).split("--draw=")[1].split(",")))
    assert plan_recording(weak, "band1", draw=advised, theta=path).force.force < held - 1


def test_a_force_where_the_band_should_be_slack(params) -> None:
    shallow = Earlier(Path("a.mcap"), None, "", "", 5.0, np.array([0.0, -0.15, 0.0]), None)
    with pytest.raises(UserError, match="a.mcap: holds 5.0 N where the band should be slack"):
        predict(params, "band1", np.array([0.0, -0.4, 0.0]), None, shallow)


def test_a_band_that_the_arm_cannot_hold(params) -> None:
    strong = Earlier(Path("a.mcap"), None, "", "", 900.0, np.array([0.0, -0.4, 0.0]), None)
    held, drawn = Held.of(params.bands["band1"], params.setup), np.array([0.0, -0.4, 0.0])
    with pytest.raises(UserError, match="900.0 N .* the band is too stiff for this arm"):
        limits.check_force(params.setup, held, drawn, predict(params, "band1", drawn, None, strong))


# A robot that follows the plan


@dataclass(frozen=True)
class Followed(Truth):
    """The small recording's world, with the hand where the plan has it."""

    way: Trajectory | None = None

    def hand(self, t: float) -> np.ndarray:
        return self.way.position(t)


@dataclass(frozen=True)
class Repeated(Followed):
    """Pull after pull; `moments` are the grasp and the release of each."""

    moments: tuple[tuple[float, float], ...] = ()

    def at(self, t: float) -> Followed:
        """The pull that is going on or was the last."""
        begun = [one for one in self.moments if one[0] <= t] or self.moments[:1]
        return Followed(*begun[-1][:1], release=begun[-1][1], draw=self.draw, way=self.way)

    def holds(self, t: float) -> bool:
        return self.at(t).holds(t)

    def force(self, t: float) -> np.ndarray:
        return self.at(t).force(t)

    def center_line(self, t: float) -> np.ndarray:
        return self.at(t).center_line(t)


FAST = {"max_speed": 0.8, "pull_speed": 0.5, "max_acceleration": 5.0, "hanging": 0.195}
FAST |= {"lead_in": 0.6, "finger_time": 0.3, "pause": 0.8, "wait": 0.5}


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """(path, plan, params) of a recording by a robot that follows a plan, with pictures."""
    inverse = BASE[0].inv()
    fork_in_base = (*inverse.apply(-BASE[1]), *inverse.as_quat())
    whole = load(ROOT / "params.yaml")
    placed = with_(whole, "setup", base_to_fork=tuple(map(float, fork_in_base)))
    params = with_(with_(placed, "plan", **FAST), "episode", duration=4.2, samples=140, tail=0.5)
    plan = plan_recording(params, "band1")
    way, release = plan.trajectory, plan.trajectory.start_of("release") + 3e-4
    truth = Followed(
        grasp=way.start_of("lift"), release=release, end=way.duration, draw=0.4, way=way
    )
    path = tmp_path_factory.mktemp("plan") / "followed.mcap"
    write_bag(path, truth)
    return path, plan, params, truth


def test_a_robot_that_follows_the_plan_makes_a_recording_that_check_accepts(recorded) -> None:
    from app.preflight.check import check_recording

    path, plan, params, truth = recorded
    np.testing.assert_allclose(
        Rotation.from_quat(plan.hand).as_matrix(), (BASE[0].inv() * HAND).as_matrix(), atol=1e-9
    )
    report = check_recording(path, params)
    assert report.usable, report.problem
    assert report.signals["release_s"] == pytest.approx(truth.release, abs=1e-3)
    assert report.signals["draw_m"] == pytest.approx([0, -0.4, 0], abs=1e-3)


def test_a_robot_that_pulls_twice_makes_two_recordings_in_one_file(recorded, tmp_path) -> None:
    from app.preflight.check import look_at

    plan = plan_recording(recorded[2], "band1", pulls=2)
    way, path = plan.trajectory, tmp_path / "twice.mcap"
    begins = list(zip([phase.name for phase in way.phases], way.times, strict=False))
    grasps = [time for name, time in begins if name == "lift"]
    releases = [time + 3e-4 for name, time in begins if name == "release"]
    moments = tuple(zip(grasps, releases, strict=True))
    write_bag(path, Repeated(end=way.duration, draw=0.4, way=way, moments=moments))
    report = look_at(path, recorded[2], pull=2).report
    assert plan.content()["pulls"] == len(report.pulls) == 2
    assert all(pull.usable for pull in report.pulls), str(report.pulls)
    assert [pull.release_s for pull in report.pulls] == pytest.approx(releases, abs=1e-3)
    assert [pull.grasp_s for pull in report.pulls] == pytest.approx(grasps, abs=0.021)
    assert "rest" not in {caution.about for caution in report.cautions}
    with pytest.raises(UserError, match="--pulls: at most 10 in one recording, got 11"):
        plan_recording(recorded[2], "band1", pulls=11)


def test_an_earlier_recording_gives_base_frame_and_force(recorded) -> None:
    """Frame and force are the recording's; the law there is its formula, known at its own draw."""
    path, plan, params, truth = recorded
    unknown = with_(params, "setup", base_to_fork=None)
    again = plan_recording(unknown, "band1", recording=path)
    np.testing.assert_allclose(again.base.translation, plan.base.translation, atol=1e-6)
    np.testing.assert_allclose(again.hand, plan.hand, atol=1e-6)
    assert again.base_source == "/tf_static fork <- base"
    force = float(np.linalg.norm(truth.force(truth.release - 0.1)))
    assert again.force.force == pytest.approx(force, rel=0.01)
    deeper = plan_recording(unknown, "band1", recording=path, draw=(-0.44, 0.0)).force
    stretch = 2 * np.hypot(0.1375, np.array([0.4, 0.44])) / REST
    tension = stretch - stretch**-2
    cosine = np.array([0.4, 0.44]) / np.hypot(0.1375, [0.4, 0.44])
    ratio = np.divide(*(tension * cosine)[::-1])
    assert deeper.force / again.force.force == pytest.approx(ratio, rel=2e-3)
    assert deeper.source.endswith("beyond that stretch a band may stiffen")
    assert "scaled" not in again.force.source

    weak = with_(unknown, "setup", max_force=force - 2)
    with pytest.raises(UserError, match=r"N more than setup.max_force .*--draw=-0\.\d\d,0\.00"):
        plan_recording(weak, "band1", recording=path)


def test_a_band_to_come_is_planned_by_its_sizes(params) -> None:
    known, name = with_band(params, "band1")
    assert (known, name) == (params, "band1")
    longer, name = with_band(params, None, 0.04, 0.02, 0.6)
    assert name == "new" and longer.bands["new"].rest_length == 0.6 and "new" not in params.bands
    assert plan_recording(longer, name).stretch < plan_recording(params, "band1").stretch
    assert with_band(params, "red", None, None, 0.6)[1] == "red"
    for arguments, words in (
        ((None,), "give --band, or --diameter and --rest-length of a band to come"),
        (("band1", 0.04), "--band band1 brings its sizes from params.yaml"),
        ((None, None, None, 0.2), "--rest-length 0.2: must be longer than setup.fork_width 0.275"),
    ):
        with pytest.raises(UserError, match=words):
            with_band(params, *arguments)


def test_of_several_pulls_the_first_that_can_be_used_tells(recorded, monkeypatch) -> None:
    """A first pull that says nothing is passed over, as `check` does."""
    from pipeline.recording import pulls, signals

    path, _, params, truth = recorded
    (whole,) = pulls.pulls_of(read_recording(path, params.setup), params.setup)
    tell = signals.signals_of

    def signals_of(pull, *others):
        if pull == "bad":
            raise UserError("nothing is drawn")
        return tell(pull, *others)

    monkeypatch.setattr(signals, "signals_of", signals_of)
    monkeypatch.setattr(pulls, "pulls_of", lambda *_: ["bad", whole])
    force = float(np.linalg.norm(truth.force(truth.release - 0.1)))
    assert read_earlier(path, params).force == pytest.approx(force, rel=0.01)
    monkeypatch.setattr(pulls, "pulls_of", lambda *_: ["bad", "bad"])
    assert read_earlier(path, params).problem == f"{path}: nothing is drawn"


def test_a_recording_without_a_pull_gives_the_frame_alone(recorded, tmp_path) -> None:
    path = tmp_path / "still.mcap"
    write_bag(path, Truth(stiffness=0.0), cameras=False, rate=200)
    unknown = with_(recorded[2], "setup", base_to_fork=None)
    plan = plan_recording(unknown, "band1", recording=path)
    assert plan.force.force is None
    assert "no release of a drawn band is in it" in plan.force.source
