"""Forces that no sound sensor makes of a drawn band: each is found by its name."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.spatial.transform import Rotation

from sling2sim2real.base.errors import UserError
from sling2sim2real.recording.force import flat_top, sensor_turns
from tests.recording.made import abouts, of_signals, with_force


def turned(done, params, axis: str, degrees: float):
    turn = sensor_turns(done.pull.motion, done.pull.geometry, done.pull.force_time[:1])[0]
    turn = turn.inv() * Rotation.from_euler(axis, degrees, degrees=True) * turn
    return with_force(done, lambda _, values: turn.apply(values), params)


@pytest.mark.fires("direction")
@pytest.mark.parametrize("axis", ["x", "z"])
@pytest.mark.parametrize("degrees", [-28, -15, -6, 6, 15, 28])
def test_a_turned_sensor(checked, params, axis, degrees) -> None:
    message = [
        finding
        for finding in of_signals(turned(checked, params, axis, degrees), params)
        if finding.about == "direction"
    ]
    assert len(message) == 1 and message[0].refused == (abs(degrees) > 12)
    way = {"x": ("presses down", "lifts"), "z": ("to the right", "to the left")}[axis]
    assert way[degrees > 0] in message[0].what


@pytest.mark.fires("range")
@pytest.mark.parametrize("share", [0.3, 0.7, 0.95])
def test_a_range_that_ends(checked, params, share) -> None:
    peak = share * np.linalg.norm(checked.signals.facts.hold_force)

    def clipped(t, values):
        rest = values[t < 0.5].mean(axis=0)
        k = int(np.argmax(np.ptp(values, axis=0)))
        most = peak * np.ptp(values[:, k]) / np.linalg.norm(checked.signals.facts.hold_force)
        values = values.copy()
        values[:, k] = np.clip(values[:, k], rest[k] - most, rest[k] + most)
        return values

    message = of_signals(with_force(checked, clipped, params), params)
    assert [finding.about for finding in message if finding.refused][0] == "range"
    assert "its range ends" in "".join(finding.what for finding in message)


@pytest.mark.parametrize("every", [1, 20])
def test_a_hand_that_moves_before_the_pull_is_no_noise(checked, every) -> None:
    """A filter leaves little noise, and little of it is left while the tool is shaken."""
    wrench, t = checked.pull.recording.wrench, checked.pull.force_time
    smooth = lfilter(np.ones(30) / 30, 1, wrench.values - wrench.values[0], axis=0)
    shaken = 2.0 * np.sin(25 * t) * ((t > 0.1) & (t < 0.4))
    values = wrench.values[0] + smooth + shaken[:, None]
    changed = replace(wrench, stamp=wrench.stamp[::every], values=values[::every])
    recording = replace(checked.pull.recording, wrench=changed)
    assert flat_top(replace(checked.pull, recording=recording)) is None


@pytest.mark.fires("units")
def test_units(checked, params) -> None:
    for newtons, refused in ((1e-3, True), (9.81, False)):
        odd = with_force(checked, lambda _, values, by=newtons: values / by, params)
        message = of_signals(odd, params)
        units = [finding for finding in message if finding.about == "units"]
        assert units and units[0].refused == refused and "publish newtons" in units[0].cure
    with pytest.raises(UserError, match="or it is not in newtons"):
        with_force(checked, lambda _, values: values / 1e3, params)


@pytest.mark.fires("filter")
@pytest.mark.parametrize("count", [10, 20, 40])
def test_a_filtered_force(checked, params, count) -> None:
    """A moving average: its release is unsure by what it delays."""

    def averaged(_, values):
        return values[0] + lfilter(np.ones(count) / count, 1, values - values[0], axis=0)

    odd = with_force(checked, averaged, params)
    assert "filter" in abouts(of_signals(odd, params))
    late = (count - 1) / 2 * odd.pull.recording.wrench.period
    assert odd.pull.release.error > late / 2


@pytest.mark.parametrize("at", [0.3, 1.2, 2.0])
def test_a_sensor_that_is_zeroed_while_recording_is_refused(checked, params, at) -> None:
    """While free, slack or drawn: its own values then are taken off."""

    def zeroed(t, values):
        level = values[(t > at - 0.05) & (t < at)].mean(axis=0)
        return values - np.outer(t > at, level)

    try:
        found = of_signals(with_force(checked, zeroed, params), params)
    except UserError as error:
        assert "zeroed" in str(error)
    else:
        assert any(finding.about == "zero" and finding.refused for finding in found)


@pytest.mark.parametrize(("share", "refused"), [(0.05, False), (0.2, True)])
def test_a_zero_that_does_not_return(checked, params, share, refused) -> None:
    release = checked.pull.release.time
    by = share * np.linalg.norm(checked.signals.facts.hold_force) / np.sqrt(3)
    odd = with_force(checked, lambda t, x: x + by * (t > release + 0.01)[:, None], params)
    (message,) = (finding for finding in of_signals(odd, params) if finding.about == "zero")
    assert message.refused == refused and "after the release" in message.what
