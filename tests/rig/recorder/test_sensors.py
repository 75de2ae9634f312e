"""Flaws are as large as params.yaml says, and the force measured is what statics says."""

import numpy as np
import pytest

from pipeline.params import Params
from rig.physics import launch as launches
from rig.physics.motion import OPEN, HandMotion
from rig.physics.robot import SENSOR_LEVER, Robot
from rig.physics.world import bent_at, string_of
from rig.recorder.camera import Exposure, VirtualCamera, exposed, measured_depth
from rig.recorder.interaction import Interaction
from rig.recorder.record import radius
from rig.recorder.sensors import TOOL_CENTER, wrench

COUNT = 20_000
FORCE, ACCELERATION = np.array([1.0, 12.0, -3.0]), np.array([0.5, -2.0, 0.7])


def test_wrench(params: Params) -> None:
    """Free-body diagram: band at the tool centre point, tool between it and the sensor."""
    rig, rng = params.rig, np.random.default_rng(0)
    robot, settings = Robot.of(rig), rig.wrench
    still = np.zeros((COUNT, 3))
    happened = Interaction(still + FORCE, still, still + ACCELERATION, None, None, 0.0)
    response = robot.sensor.apply(wrench(happened, robot, settings, rng).reshape(-1, 3))
    response = response.reshape(COUNT, 2, 3)
    tool = settings.tool_mass * (np.array([0.0, 0.0, -9.81]) - ACCELERATION)
    ahead = np.array([0.0, np.cos(rig.tool_pitch), -np.sin(rig.tool_pitch)])
    torque = np.cross(SENSOR_LEVER * ahead, FORCE + TOOL_CENTER * tool)
    np.testing.assert_allclose(response[:, 1].mean(axis=0), torque, atol=3e-4)
    np.testing.assert_allclose(response[:, 1].std(axis=0), settings.torque_noise, rtol=0.03)
    astray = response[:, 0] - FORCE - tool
    time = np.linspace(0, 1, COUNT)
    drift, bias = np.polyfit(time, astray, 1)
    assert np.isclose(np.linalg.norm(bias), settings.bias, rtol=0.01)
    assert np.isclose(np.linalg.norm(drift), settings.drift, rtol=0.1)
    noise = astray - np.outer(time, drift) - bias
    np.testing.assert_allclose(noise.std(axis=0), settings.noise, rtol=0.03)


def test_depth_and_colour(params: Params) -> None:
    """Noise of a wall grows with its distance squared; pixels drop out; beyond a range is none."""
    settings, rng = params.rig.camera, np.random.default_rng(0)
    for distance in (1.0, 2.0):
        flat = np.full((480, 640), distance, np.float32)
        depth = measured_depth(Exposure(np.zeros((480, 640, 3)), flat, flat, flat), settings, rng)
        there = depth[depth > 0] / 1000
        deviation = np.hypot(settings.depth_noise * distance**2, 1e-3 / np.sqrt(12))
        assert np.isclose(there.std(), deviation, rtol=0.02)
        assert np.isclose(there.mean(), distance, atol=1e-4)
        assert np.isclose((depth == 0).mean(), settings.dropout, rtol=0.15)
    grey = exposed(np.full((480, 640, 3), 0.5), settings, rng)
    assert np.isclose(grey.std(), np.hypot(settings.color_noise, 1 / np.sqrt(12)), rtol=0.02)
    flat = np.full((480, 640), 1.01 * settings.range, np.float32)
    beyond = Exposure(np.zeros((480, 640, 3)), flat, flat, flat)
    assert not measured_depth(beyond, settings, rng).any()


def test_calibration(params: Params) -> None:
    settings = params.rig.camera
    camera = VirtualCamera.looking(
        np.array(settings.position), np.array(settings.target), settings.focal
    )
    believed = camera.misplaced(settings, np.random.default_rng(0))
    off = np.linalg.norm(believed.position - camera.position)
    turned = (camera.rotation.inv() * believed.rotation).magnitude()
    assert np.isclose(off, settings.translation_error)
    assert np.isclose(turned, settings.rotation_error)


def test_the_wander_is_as_large_as_stated(params: Params) -> None:
    error = params.rig.tracking_error
    still, wanders = (
        HandMotion.through(np.array([0.0, 0.0, -0.2]), size, (0.004, 1.0), np.random.default_rng(0))
        for size in (0.0, error)
    )
    time = np.linspace(0, 1000, 50_000)  # many turns; the path itself stays where it ends
    astray = (wanders.position(time) - still.position(time)).std(axis=0)
    np.testing.assert_allclose(astray, error, rtol=0.02)


def test_errors_of_launches(params: Params, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every trial its own, of the stated size, in y and z alone."""
    monkeypatch.setattr(launches, "string_of", lambda params, band: None)
    monkeypatch.setattr(launches, "launch_from", lambda string, params, *errors: errors)
    done = [launches.launch("band1", params, (-0.3, -0.15), seed) for seed in range(2000)]
    aims, kicks = np.moveaxis(done, 1, 0)
    assert len(np.unique(aims[:, 1])) == len(done)
    sizes = params.trials.actuation_error, params.rig.release_jitter
    for errors, center, size in zip((aims, kicks), ([-0.3, -0.15], [0, 0]), sizes, strict=True):
        assert not errors[:, 0].any()
        np.testing.assert_allclose(errors[:, 1:].mean(axis=0), center, atol=0.1 * size)
        np.testing.assert_allclose(errors[:, 1:].std(axis=0), size, rtol=0.05)


def test_the_band_slips_when_its_force_is_coulombs(coarse, recorded) -> None:
    """Two pads whose force dies by a power: 2 mu N (1 - t / t_open)^shape = F."""
    happened, pads = recorded[1], coarse.rig.pads
    pull = np.linalg.norm(happened.force[round(1000 * OPEN)])
    share = pull / (2 * pads.friction * pads.force)
    expected = pads.opening_time * (1 - share ** (1 / pads.shape))
    assert np.isclose(happened.slip_time - OPEN, expected, atol=1e-5)


def test_a_launch_holds_what_the_recording_held(coarse, recorded) -> None:
    """The same draw after the same pause, by an arm that gives way alike: by a millimetre."""
    held = np.linalg.norm(recorded[1].force[round(1000 * OPEN)])
    launched = launches.launch("band1", coarse, (-0.40, 0.0), None).hold_force
    assert np.isclose(launched, held, rtol=1.5e-3)  # a firm arm: 3.6e-3
    assert launched < 0.985 * coarse.rig.bands["band1"].peak_force


def test_the_seen_band_keeps_its_volume(coarse: Params) -> None:
    string = string_of(coarse, "band1")
    line = bent_at(string, np.array([0.0, -0.4, 0.0]))
    length = np.linalg.norm(np.diff(line, axis=0), axis=1).sum()
    volume = np.pi * radius(string, line) ** 2 * length
    np.testing.assert_allclose(volume, np.pi / 4 * string.diameter**2 * string.length, rtol=1e-6)
