"""What `sling aim` and `sling launch` print: keys that scripts rely on, and the hand's pose."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from sling2sim2real import Band, Identification, Settings, Theta
from sling2sim2real.api.identification import Fork
from sling2sim2real.api.launching import Aim, Hazard, Launch
from sling2sim2real.cli.aim import of_aim
from sling2sim2real.cli.plan.plan import plan_recording
from tests.cli.lab import NAME
from tests.policy.linear import write_policy

FORK_IN_BASE = (0.7, 0.1, 0.4, 0.0, 0.0, -(0.5**0.5), 0.5**0.5)  # the target along the base's x
TIPS = np.array([[-0.1375, 0, 0], [0.1375, 0, 0]])
BAND = Band(mass=0.023, diameter=0.010, rest_length=0.52)
FOUND = Identification(BAND, Theta(2.0e5, 0.47, 2.4e-3, 0.7, 0.6), settings=Settings.default())


def at(y: float, z: float, pose: tuple | None, found: Identification = FOUND) -> dict:
    """The answer for a draw, the fork there in the robot's base."""
    hazards = (Hazard("box", "as before"),)
    launched = Launch((y, z), 1.9, (1.8, 2.0), 4.0, 0.7, (0.0, 0.0), 9.0, None, None, hazards)
    settings = found.settings.changed(setup={"base_to_fork": pose})
    return of_aim(Aim(1.9, launched, hazards), replace(found, settings=settings))


UNIT = st.lists(st.floats(-1, 1), min_size=4, max_size=4).filter(lambda q: np.linalg.norm(q) > 0.1)
PLACE = st.lists(st.floats(-2, 2), min_size=3, max_size=3)


@given(place=PLACE, turn=UNIT, y=st.floats(-2, -0.05), z=st.floats(-2, 1))
def test_band_hand_and_launch_lie_in_one_plane(place, turn, y, z) -> None:
    """In the base, by a homogeneous matrix: all of the band's plane is across the hand's y."""
    turn = np.array(turn) / np.linalg.norm(turn)
    pose = at(y, z, (*place, *turn.tolist()))
    to_base = np.eye(4)
    to_base[:3, :3], to_base[:3, 3] = Rotation.from_quat(turn).as_matrix(), place

    def in_base(point) -> np.ndarray:
        return (to_base @ [*point, 1.0])[:3]

    quaternion = np.array(pose["tcp_quaternion_xyzw"])
    assert np.linalg.norm(quaternion) == pytest.approx(1.0, abs=1e-12) and quaternion[3] >= 0
    axes = Rotation.from_quat(quaternion).as_matrix()
    tcp = np.array(pose["tcp_position_m"])
    np.testing.assert_allclose(tcp, in_base([0, y, z]), atol=1e-6)
    seen = [axes.T @ (in_base(point) - tcp) for point in (*TIPS, np.zeros(3))]
    np.testing.assert_allclose([way[1] for way in seen], 0.0, atol=2e-6)
    left, right, origin = seen
    np.testing.assert_allclose(origin, [0, 0, np.hypot(y, z)], atol=2e-6)  # straight ahead
    np.testing.assert_allclose(right - left, [0.275, 0, 0], atol=1e-9)
    assert (pose["tcp_frame"], pose["hold_force_n"], list(pose)[-1]) == ("base", 9.0, "warnings")
    launch = np.array([0, np.cos(pose["pitch_rad"]), np.sin(pose["pitch_rad"])])
    np.testing.assert_allclose(axes[:, 2], to_base[:3, :3] @ launch, atol=1e-12)


def test_the_plan_of_a_recording_holds_the_same_draw_alike(tmp_path) -> None:
    """By the CSV that a robot would follow: its pause."""
    standing = (0.62, -0.05, 0.41, 0.02, -0.03, -0.7, float(np.sqrt(1 - 0.4913)))
    settings = FOUND.settings.changed(setup={"base_to_fork": standing})
    for draw in ((-0.40, 0.0), (-0.3, -0.25)):
        plan = plan_recording(settings, BAND, draw=draw)
        with plan.write(tmp_path, 100.0)[0].open(newline="") as file:
            drawn = next(row for row in csv.DictReader(file) if row["phase"] == "pause")
        pose = at(*draw, standing)
        assert pose["tcp_frame"] == plan.about["frame"]
        columns = "x y z", "qx qy qz qw"
        position, turn = ([float(drawn[name]) for name in names.split()] for names in columns)
        np.testing.assert_allclose(pose["tcp_position_m"], position, atol=1e-6)
        np.testing.assert_allclose(pose["tcp_quaternion_xyzw"], turn, atol=1e-8)


def test_setup_comes_before_the_recording_which_names_the_base() -> None:
    recorded = replace(FOUND, fork=Fork(pose=(0.0, 0, 0, 0, 0, 0, 1.0), frame="arm"))
    given = at(-0.3, -0.3, FORK_IN_BASE, recorded)
    assert given["tcp_frame"] == "arm"
    assert given["tcp_position_m"] == pytest.approx([0.4, 0.1, 0.1])
    alone = at(-0.3, -0.3, None, recorded)
    assert (alone["tcp_frame"], alone["tcp_position_m"]) == ("arm", [0.0, -0.3, -0.3])


def test_a_base_that_is_not_known_is_one_warning() -> None:
    pose = at(-0.3, -0.3, None)
    assert [pose[name] for name in pose if name.startswith("tcp")] == [None, None, None]
    assert pose["pitch_rad"] == pytest.approx(np.pi / 4)
    assert [hazard.about for hazard in pose["warnings"]] == ["box", "pose"]
    assert "\n" not in str(pose["warnings"][1])


STABLE = ["draw_y_m", "draw_z_m", "predicted_landing_m", "interval_90_m", "hold_force_n"]
POSE = ["pitch_rad", "tcp_frame", "tcp_position_m", "tcp_quaternion_xyzw"]


def test_aim_prints_one_json_object(copied, sling) -> None:
    """The keys that scripts rely on; the text has them too."""
    arguments = ("aim", f"bands/{NAME}", "--target", "1.9")
    done = sling(*arguments, "--json", folder=copied)
    answer = json.loads(done.stdout)
    assert list(answer) == [*STABLE, "max_force_n", "pull_and_pause_s", *POSE, "warnings"]
    assert answer["predicted_landing_m"] == pytest.approx(1.9, abs=1e-3)
    assert answer["interval_90_m"][0] < 1.9 < answer["interval_90_m"][1]
    assert answer["tcp_frame"] == "base" and done.returncode == 0
    done = sling(*arguments, folder=copied)
    shown = dict(line.split(maxsplit=1) for line in done.stdout.splitlines())
    assert [*shown] == [*answer][:-1] and shown["predicted_landing_m"] == "1.9"


def test_a_target_that_no_draw_hits_is_refused_with_those_that_can_be(copied, sling) -> None:
    """Its exit status is its own; --force answers all the same. By a policy too."""
    arguments = ("aim", NAME, "--target", "19")  # a name in bands/ will do
    done = sling(*arguments, folder=copied)
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (3, "", 1)
    assert "draws of the box (setup.draw_y, draw_z) land from" in done.stderr
    done = sling(*arguments, "--json", folder=copied)
    assert done.returncode == 3 and json.loads(done.stdout).keys() == {"refused"}
    done = sling(*arguments, "--force", "--json", folder=copied)
    abouts = {warning["about"] for warning in json.loads(done.stdout)["warnings"]}
    assert done.returncode == 0 and abouts & {"miss", "force"}

    write_policy(copied / "bands/toy/policy.onnx", slope=(-0.01, 0.0), offset=(-0.31, -0.15))
    assert "policy.json: missing" in sling(*arguments, folder=copied).stderr


def test_launch_prints_one_json_object(fitted, tmp_path, sling) -> None:
    """By the band's θ, and by one that was written by hand."""
    keys = ["landing_y_m", "interval_90_m", "speed_m_s", "hold_force_n", "pull_and_pause_s"]
    arguments = ("launch", f"bands/{NAME}", "--draw=-0.30,-0.17", "--json")
    first = json.loads(sling(*arguments, folder=fitted).stdout)
    assert list(first) == [*keys, "failure", "warnings"]
    assert first["failure"] is None and 0.5 < first["landing_y_m"] < 6.0
    theta = tmp_path / "theta.json"
    five = vars(FOUND.theta)
    names = ("youngs_modulus", "poissons_ratio", "elasticity_damping", "dynamic_friction")
    content = {name: five[name] for name in (*names, "damping_scale")}
    theta.write_text(json.dumps({"band": "any", "theta": content}))
    done = sling(*arguments, "--theta", str(theta), folder=fitted)
    mine = json.loads(done.stdout)
    assert mine["landing_y_m"] != first["landing_y_m"] and "pull_and_pause_s" not in mine
    assert [row["about"] for row in mine["warnings"]] == ["confidence"]
