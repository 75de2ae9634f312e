"""Episodes of the simulator's own law: what is found, how sure that is, what is written."""

import json
from dataclasses import replace

import numpy as np
import pytest

from sling2sim2real.base.errors import UserError
from sling2sim2real.episode.signal import cutoff_hz
from sling2sim2real.identification.posterior import confidence, coordinates, identify
from sling2sim2real.identification.posterior.coordinates import Coordinates
from sling2sim2real.identification.posterior.fit import SETTLED_SIZE
from sling2sim2real.identification.posterior.launches import LaunchLikelihood, Observed
from sling2sim2real.identification.posterior.likelihood import Likelihood
from sling2sim2real.identification.posterior.residuals import Residuals, Rule
from sling2sim2real.identification.posterior.sampling import Remaining
from sling2sim2real.identification.results.theta import load_theta
from sling2sim2real.simulator.interaction import interact
from sling2sim2real.simulator.model import LaunchSetup
from tests import once
from tests.identification.objective.pulls import PARAMS, pulled, sling_of
from validation.synthetic import own_law_episode

METHOD, WORKERS, LOSS = "posterior", 2, "log_loss_factor"
SLING = replace(sling_of(0.03), law="rubber")
SPACE = Coordinates.of_method(PARAMS, METHOD, SLING)
CUTOFF = cutoff_hz(PARAMS.force.cutoff, PARAMS.force.cutoff_unit)
TRUE = np.array([np.log(3e5), np.log(0.07), 0.3, 0.05, 0.06, 0.02, 0.1, 2.0, 0.0, 0.4, 0.0])
START = TRUE + [0.1, -0.3, -0.1, 0.03, -0.03, 0.01, -0.05, 0.0, 0.0, 0.0, 0.0]
TRUTH, FROM = (SPACE.parameters(phi[None]) for phi in (TRUE, START))
NOISE = 0.05, 0.0006  # N, m


def recorded(phase: float, seed: int, noise=(0.0, 0.0)):
    """Hang, grasp at 0.6 s, lift by 1.2 s, pull to 0.4 m by 3 s, release at 3.8 s."""
    empty = pulled(160, 130, 0.6, (0.6, 1.2), (1.2, 3.0), 3.8, first_frame=phase)
    force, depth = noise
    options = {"force_noise": force, "depth_noise": depth, "seed": seed}
    return own_law_episode(SLING, empty, TRUTH, cutoff=CUTOFF, **options)


def found_of(*episodes, workers: int = WORKERS):
    return identify.fit_posterior(PARAMS, METHOD, SLING, episodes, FROM, workers=workers)


@pytest.fixture(scope="module")
def exact(tmp_path_factory):
    return once.value(tmp_path_factory, "exact", lambda _: [recorded(0.0, 1), recorded(0.012, 2)])


@pytest.fixture(scope="module")
def first(exact):
    return found_of(exact[0])


@pytest.fixture(scope="module")
def both(exact):
    return found_of(*exact)


def test_what_moves_a_whole_picture_of_the_recoil_counts_as_one_error(first) -> None:
    """A constant repeats itself in all bins, alternating signs in none."""
    (expansion,) = first.fit.expansions
    seen, weight = expansion.form.residuals, expansion.form.weight
    count = len(weight) - 2 * len(seen.picture)
    picture = seen.picture[seen.recoils][0]
    bins = np.flatnonzero(seen.picture == picture)
    travelled = seen.travelled()[bins[0]]
    for signs, repeated in ((1.0, np.sqrt(len(bins))), ((-1.0) ** np.arange(len(bins)), 1.0)):
        residual = np.zeros_like(expansion.residual)
        residual[count + bins] = 2e-3 * signs * weight[count + bins]
        discrepancy = replace(expansion, residual=residual).recoil_discrepancy
        assert discrepancy == pytest.approx(2e-3 / travelled * repeated, rel=0.25)
        wider = (
            first.recordings[0]
            .with_wider_tolerances(replace(expansion, residual=residual))
            .tolerances
        )
        assert wider.recoil == max(first.recordings[0].tolerances.recoil, discrepancy)


def test_the_truth_is_found_where_no_prior_pulls(exact, monkeypatch):
    """All priors expect the truth, but for the loss factor's."""
    expected, precision = SPACE.expected.copy(), SPACE.precision.copy()
    precision[SPACE.names.index(LOSS)] = 0.0
    for name in ("softening", "flow"):
        axis = SPACE.names.index(name)
        expected[axis], precision[axis] = TRUE[axis], 0.15**-2
    centred = replace(SPACE, expected=expected, precision=precision)
    monkeypatch.setattr(Coordinates, "of_method", lambda *method: centred)
    result = found_of(*exact)
    assert result.fit.settled
    gap = result.fit.phi - TRUE
    assert np.sqrt(gap @ result.fit.hessian @ gap) < 4 * SETTLED_SIZE  # of standard deviations
    assert abs(gap[0]) < 4e-3 and abs(gap[1]) < 0.15


def test_a_value_at_an_edge_is_not_settled(first):
    assert first.settled == first.fit.settled
    beyond = confidence.confidence(replace(first, edges={"mooney_share": "upper"}))
    assert not beyond["settled"] and beyond["edges"] == {"mooney_share": "upper"}


def test_the_loss_factors_prior_pulls_towards_it_and_no_farther(first):
    mean = SPACE.expected[SPACE.names.index(LOSS)]
    assert mean < first.fit.phi[1] < TRUE[1]
    deviation = np.sqrt(np.linalg.inv(first.fit.hessian)[0, 0])
    assert abs(first.fit.phi[0] - TRUE[0]) < 0.4 * deviation


def test_samples_lie_on_both_sides_of_the_truth_and_two_recordings_narrow_them(first, both):
    """At least 3 in 100 of them. The width is the fit's: that of samples differs by chance."""
    for result in (first, both):
        for name, samples, true in zip(SPACE.names, result.samples.T, TRUE, strict=True):
            axis = SPACE.names.index(name)
            inside = SPACE.low[axis] < true < SPACE.high[axis]
            if inside:
                assert 0.03 < np.mean(samples < true) < 0.97, name
    deviations = [np.sqrt(np.linalg.inv(result.fit.hessian)[0, 0]) for result in (first, both)]
    assert deviations[1] < 0.85 * deviations[0]


def test_alike_recordings_agree(both):
    summary = confidence.confidence(both)
    assert summary["disagreement"] == both.birge == 1.0
    assert len(summary["recordings"]) == 2 and "misfit_without" in summary["recordings"][0]


def test_what_is_written_is_a_theta_file(first, tmp_path):
    path = tmp_path / "posterior.json"
    content = {"band": "known", **confidence.theta_entries(first)}
    content["confidence"] = confidence.confidence(first)
    content |= {"loss": dict.fromkeys(("geom", "force", "work", "total"), 1.0), "rollouts": 1}
    path.write_text(json.dumps(content, allow_nan=False))
    read = load_theta(path, "known")
    assert read["theta"] == content["theta"] and read["history"] == content["history"]
    names = first.parameters.names
    assert names == (*content["theta"], "air_drag", "turn_damping", "returned_share")
    assert first.parameters.values.shape == (identify.SAMPLES, len(names))


def test_the_theta_file_is_of_the_band_after_all_that_stretched_it(first):
    """The deepest recording, or a launch that went deeper."""
    episode = first.recordings[0].episode
    deeper = replace(episode, position=1.1 * episode.position)
    history = identify.recorded_history(SLING, [episode])
    assert confidence.theta_entries(first)["history"] == vars(history)
    for two in ([episode, deeper], [deeper, episode]):
        assert identify.recorded_history(SLING, two).deepest == pytest.approx(1.1 * history.deepest)
    setup = LaunchSetup.of(PARAMS.setup, PARAMS.sling, history)
    for draw, deepest in (((-0.1, -0.1), history.deepest), ((-0.6, -0.3), np.hypot(0.6, 0.3))):
        launches = LaunchLikelihood([Observed(draw, 0.001, 3.0)], SLING, setup)
        written = confidence.theta_entries(replace(first, launches=launches))
        assert written["history"] == vars(replace(history, deepest=float(deepest)))


def test_what_remains_at_the_mode_is_its_misfit(both):
    """But for the last step of the simulated nuisances, which are free here."""
    parts = both.fit, SPACE, both.recordings, None, WORKERS
    phi = np.repeat(both.fit.phi[None], 2, axis=0)
    phi[1, coordinates.LOSS] += 0.3
    left = Remaining(*parts)(phi)
    misfit = sum(expansion.misfit for expansion in both.fit.expansions)
    assert np.sum(left[0] ** 2) == pytest.approx(misfit, abs=0.5)
    assert np.sum(left[1] ** 2) > misfit + 0.5  # the recoil's pictures show it


def test_samples_are_worth_many_and_said(first):
    assert (
        identify.SAMPLES / 4
        < confidence.confidence(first)["effective_samples"]
        <= identify.SAMPLES + 1e-6
    )


def test_constant_coordinates_correlate_with_nothing():
    """Not even with each other, as those that lie at a bound in all samples."""
    some = np.random.default_rng(0).normal(size=(200, 2))
    samples = np.column_stack([some, np.full(200, 0.1), np.full(200, 0.3)])
    expected = np.eye(4)
    expected[:2, :2] = np.corrcoef(some.T)
    np.testing.assert_allclose(confidence.correlation(samples), expected)
    np.testing.assert_array_equal(confidence.correlation(samples[:, 2:]), np.eye(2))
    np.testing.assert_array_equal(confidence.correlation(samples[:, 1:3]), np.eye(2))


@pytest.mark.slow
def test_workers_change_no_byte(exact, first):
    again = found_of(exact[0], workers=1)
    np.testing.assert_array_equal(again.parameters.values, first.parameters.values)
    assert json.dumps(confidence.confidence(again)) == json.dumps(confidence.confidence(first))


def test_residuals_at_the_truth_are_of_the_size_of_the_noise():
    """Of the force what its low-pass leaves of white noise, and of a bin far below a point's."""
    episode = recorded(0.012, 5, NOISE)
    recording = Likelihood(episode, SLING, CUTOFF, 0.7)
    (rollouts,) = recording.simulate(TRUTH, np.zeros(3))
    residuals = Residuals(episode, SLING, CUTOFF, rollouts.center_line[0])
    gap, count = residuals(rollouts)[0], 3 * len(residuals.samples)
    assert 0.1 * NOISE[0] < gap[:count].std() < 0.5 * NOISE[0]
    assert 1e-5 < gap[count:].std() < NOISE[1]


def test_bias_and_shift_move_the_residuals_by_their_columns(exact):
    episode = exact[0]
    rollouts = interact(SLING, episode, TRUTH)
    base = Residuals(episode, SLING, CUTOFF, rollouts.center_line[0])
    left, bias, shift = base(rollouts)[0], np.array([0.02, -0.05, 0.1]), [3e-4, -2e-4, 4e-4]
    columns = base.columns(left)
    moved = replace(
        episode,
        force=episode.force + bias,
        clouds=[(cloud + np.array(shift)).astype(np.float32) for cloud in episode.clouds],
    )
    count = 3 * len(base.samples)
    force = Residuals(moved, SLING, CUTOFF, rollouts.center_line[0])(rollouts)[0]
    expected = np.tensordot(bias, [columns[f"force_bias_{axis}"] for axis in "xyz"], 1)
    np.testing.assert_allclose((force - base(rollouts)[0])[:count], expected[:count], atol=1e-9)
    # a gain is of the simulated force: what is measured besides is not to explain itself
    gain = Residuals(moved, SLING, CUTOFF, rollouts.center_line[0]).columns(force)["force_gain"]
    np.testing.assert_allclose(gain, columns["force_gain"], atol=1e-9)
    # the same bins seen from their new place: the mean points move, the line does not
    cloud = base(rollouts)[0][count:]
    base.point = base.point + shift
    expected = np.tensordot(shift, [columns[f"cloud_shift_{axis}"] for axis in "xyz"], 1)
    change = base(rollouts)[0][count:] - cloud
    np.testing.assert_allclose(change, expected[count:], atol=3e-5)


def test_pictures_count_by_time_and_by_the_measured_cloud(exact):
    """Held in the last half second, of the recoil to 34 ms; where it is back in all, the first."""
    episode = exact[0]
    since = episode.cloud_time - episode.release_time
    count = since[Rule().pictures(episode)]
    held = count[count < 0]
    assert len(held) == np.count_nonzero((since > -0.5) & (since < -0.02))
    assert 1 <= np.count_nonzero(count > 0) and count.max() <= 0.034
    assert since[Rule(latest=1e-6).pictures(episode)].max() < 0
    first = since[since > 0].min()
    assert since[Rule(recoil=1e-6).pictures(episode)].max() == first  # for want of earlier ones
    assert since[Rule(recoil=0.2, latest=0.2, least_share=-1.0).pictures(episode)].max() > 0.1
    home = [np.where(t > 0, 0 * c, c) for t, c in zip(since, episode.clouds, strict=True)]
    came_back = since[Rule().pictures(replace(episode, clouds=home))]
    assert np.count_nonzero(came_back > 0) == 1
    short = Rule(held=(-0.2, -0.02), force_until=-0.3)
    assert len(short.pictures(episode)) < len(count)
    assert len(short.samples(episode)) < len(Rule().samples(episode))


@pytest.mark.slow
def test_where_no_picture_of_the_drawn_band_counts_the_hand_says_where_it_was(exact, first) -> None:
    """A camera that drops most pictures: the recoil's discrepancy stays a finite share."""
    episode = exact[0]
    since = episode.cloud_time - episode.release_time
    others = np.flatnonzero((since < -0.6) | (since > 0))
    few = replace(
        episode,
        cloud_time=episode.cloud_time[others],
        clouds=[episode.clouds[number] for number in others],
    )
    (expansion,), (usual,) = found_of(few).fit.expansions, first.fit.expansions
    travelled, expected = (some.form.residuals.travelled().max() for some in (expansion, usual))
    assert travelled == pytest.approx(expected, abs=5e-3)
    assert 0 < expansion.recoil_discrepancy < 1


def test_a_recording_that_never_shows_the_band_is_refused(exact):
    empty = replace(exact[0], clouds=[cloud[:3] for cloud in exact[0].clouds])
    with pytest.raises(UserError, match="no picture of the drawn band .* shows 4 points of it"):
        found_of(empty)


@pytest.mark.slow
def test_pictures_with_too_few_points_along_the_band_are_said_to_count_for_nothing(exact, capsys):
    def thinned(cloud: np.ndarray) -> np.ndarray:
        chosen = np.linspace(0, len(cloud) - 1, 6).astype(int)  # from clamp to clamp
        return cloud[np.argsort(cloud[:, 0])[chosen]] if len(cloud) else cloud

    few = replace(exact[0], clouds=[thinned(cloud) for cloud in exact[0].clouds])
    result = found_of(few)
    assert confidence.confidence(result)["recordings"][0]["pictures"] == []
    (line,) = capsys.readouterr().err.splitlines()
    assert "fewer than 4 points in each of 16 parts of the band, so its force alone" in line
