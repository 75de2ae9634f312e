"""What a recording leaves open, eliminated: NumPy's least squares over all unknowns at once."""

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest

from sling2sim2real.identification.posterior.expansion import Expansion, _repeated
from sling2sim2real.identification.posterior.likelihood import Likelihood, Tolerances
from sling2sim2real.simulator.interaction import with_recorded_pads

PHI, INNER, FORCES, BINS = 4, 3, 15, 12
PICTURE = np.repeat([7, 8, 9], 4)
NAMES = [f"{name}_{axis}" for axis in "xyz" for name in ("force_bias", "force_drift")]
NAMES += [f"{name}_{axis}" for axis in "xyz" for name in ("cloud_shift", "cloud_turn")]
NAMES += ["force_delay"]


class Case:
    """Random residuals, their slopes and columns; two of the three pictures are of the recoil."""

    def __init__(self, **tolerances) -> None:
        rng = np.random.default_rng(3)
        size = 3 * FORCES + 2 * BINS
        self.tolerances = Tolerances(**tolerances)
        self.columns = {name: rng.normal(0, 1, size) for name in NAMES}
        self.residuals = SimpleNamespace(
            picture=PICTURE,
            recoils=PICTURE > 7,
            columns=lambda left: dict(self.columns),
            of_picture=lambda number: np.concatenate(
                [np.zeros(3 * FORCES, bool), PICTURE == number, PICTURE == number]
            ),
            spread=self.spread,
        )
        self.gap = rng.normal(0, 0.1, size)
        self.slopes = rng.normal(0, 1, (PHI, size))
        self.nuisance_slopes = rng.normal(0, 50, (INNER, size))
        self.nuisances = np.array([1e-4, -3e-4, 4e-6])

    def spread(self, force, cloud, recoil) -> np.ndarray:
        return np.concatenate(
            [np.full(3 * FORCES, force), np.full(2 * BINS, np.hypot(cloud, recoil))]
        )

    def expanded(self, alike: int = 1):
        recording = object.__new__(Likelihood)
        recording.tolerances, recording.camera_shift = self.tolerances, 0.0
        recording.alike = alike
        camera = self.nuisance_slopes[1]
        form = recording._form(self.residuals, self.gap, camera)
        parts = self.gap, self.slopes, self.nuisance_slopes, 0 * self.gap
        priors = recording._priors(self.nuisances), 1 / self.tolerances.simulated
        return Expansion.of(form, *parts, *priors, origin=0.0)

    def full(self) -> tuple[np.ndarray, np.ndarray]:
        """Design (rows, D + 3 + M) and aim (rows,) of all unknowns, priors as rows."""
        has = self.tolerances
        sizes = {
            "force_bias": has.bias,
            "force_drift": has.drift,
            "cloud_shift": has.shift,
            "cloud_turn": has.turn,
        }
        linear = [
            sizes[name[:-2]] * column
            for name, column in self.columns.items()
            if name != "force_delay"
        ]
        linear.append(has.pose * self.columns["force_delay"])
        linear += [
            has.jitter * np.where(self.residuals.of_picture(picture), self.nuisance_slopes[1], 0)
            for picture in (8, 9)
        ]
        sigma = self.spread(has.force, has.cloud, has.recoil)
        rows = np.concatenate([self.slopes, self.nuisance_slopes, linear]).T / sigma[:, None]
        count = len(linear)
        inner = np.zeros((INNER, rows.shape[1]))
        inner[:, PHI : PHI + INNER] = np.diag(1 / has.simulated)
        priors = np.vstack([inner, np.eye(rows.shape[1])[-count:]])
        aim = [-self.gap / sigma, -self.nuisances / has.simulated, np.zeros(count)]
        return np.vstack([rows, priors]), np.concatenate(aim)


@pytest.fixture(scope="module")
def case() -> Case:
    return Case()


def test_the_quadratic_is_the_minimum_over_the_nuisances(case):
    expansion, (rows, aim) = case.expanded(), case.full()

    def least(d: np.ndarray) -> float:
        left = aim - rows[:, :PHI] @ d
        inner = np.linalg.lstsq(rows[:, PHI:], left, rcond=None)[0]
        return float(np.sum((left - rows[:, PHI:] @ inner) ** 2))

    base = least(np.zeros(PHI))
    for d in np.random.default_rng(1).normal(0, 0.3, (5, PHI)):
        quadratic = -2 * expansion.gradient @ d + d @ expansion.hessian @ d
        assert quadratic == pytest.approx(least(d) - base, rel=1e-6)


def test_the_covariance_is_the_block_of_the_full_inverse(case):
    expansion, (rows, _) = case.expanded(), case.full()
    block = np.linalg.inv(rows.T @ rows)[:PHI, :PHI]
    np.testing.assert_allclose(np.linalg.inv(expansion.hessian), block, rtol=1e-6)
    given = np.linalg.inv(rows[:, PHI:].T @ rows[:, PHI:])
    spread = np.sqrt(np.diag(given)[:INNER])
    np.testing.assert_allclose(expansion.nuisance_spread, spread, rtol=1e-6)


def test_the_best_nuisances_follow_the_coordinates(case):
    expansion, (rows, aim) = case.expanded(), case.full()
    d = np.array([0.1, -0.2, 0.3, 0.05])
    best = [
        np.linalg.lstsq(rows[:, PHI:], aim - rows[:, :PHI] @ d, rcond=None)[0][:INNER]
        for d in (d, 0 * d)
    ]
    np.testing.assert_allclose(expansion.nuisance_change @ d, best[0] - best[1], rtol=1e-6)


def test_the_misfit_has_the_linear_ones_at_their_best_and_the_simulated_as_they_are(case):
    expansion, (rows, aim) = case.expanded(), case.full()
    linear = rows[:, PHI + INNER :]
    left = aim - linear @ np.linalg.lstsq(linear, aim, rcond=None)[0]
    assert expansion.misfit == pytest.approx(left @ left, rel=1e-9)
    np.testing.assert_allclose(
        -expansion.residual[: len(case.gap)], left[: len(case.gap)], rtol=1e-6
    )


def test_elimination_leaves_of_any_residuals_what_least_squares_does(case):
    """With the simulated nuisances free too, for residuals that no expansion has seen."""
    expansion, (rows, aim) = case.expanded(), case.full()
    some = case.gap + np.random.default_rng(2).normal(0, 0.1, (3, len(case.gap)))
    has = case.tolerances
    sigma = case.spread(has.force, has.cloud, has.recoil)
    priors = np.tile(case.nuisances / has.simulated, (3, 1))
    cleared = expansion.cleared(np.hstack([expansion.form.whitened(some), priors]))
    for residuals, left in zip(some, cleared, strict=True):
        goal = np.append(-residuals / sigma, aim[len(sigma) :])
        best = np.linalg.lstsq(rows[:, PHI:], goal, rcond=None)[0]
        assert left @ left == pytest.approx(np.sum((goal - rows[:, PHI:] @ best) ** 2), rel=1e-9)


NAMED = "force cloud recoil release camera hand jitter shift turn bias drift pose".split()


@pytest.mark.parametrize("name", NAMED)
def test_each_tolerance_widens_what_is_known(case, name):
    wide = Case(**{name: 3 * getattr(case.tolerances, name)}).expanded()
    eigenvalues = np.linalg.eigvalsh(case.expanded().hessian - wide.hessian)
    size = np.abs(case.expanded().hessian).max()
    assert eigenvalues.max() > 1e-9 * size and eigenvalues.min() > -1e-9 * size


def test_recordings_repeat_what_the_law_gets_wrong_of_the_recoil_and_no_instrument(case):
    """Three alike: where the recoil's law alone errs they tell as much as one, else more."""

    def together(case: Case) -> np.ndarray:
        return 3 * case.expanded(alike=3).hessian

    exact = dict.fromkeys(("release", "camera", "hand", "jitter", "shift", "turn", "drift"), 1e-12)
    exact |= dict.fromkeys(("bias", "gain", "pose"), 1e-12)
    by_law = Case(**exact, force=1e9, cloud=1e-12)
    np.testing.assert_allclose(together(by_law), by_law.expanded().hessian, rtol=1e-6)
    by_instruments = Case(recoil=1e-12)
    np.testing.assert_allclose(
        together(by_instruments), 3 * by_instruments.expanded().hessian, rtol=1e-6
    )
    least = np.linalg.eigvalsh(together(case) - case.expanded().hessian).min()
    assert least > -1e-9 * np.abs(together(case)).max()


def test_tolerances_are_the_episodes_own_or_as_usual():
    usual = Tolerances()
    delays = {"camera": {"error": 3e-4}, "pose": {"error": 4e-4}}
    metadata = {"preprocessing": {"release_error": 5e-4, "delays": delays}}
    summary = Tolerances.of(SimpleNamespace(metadata=metadata))
    assert (summary.release, summary.pose) == (5e-4, 4e-4)
    assert summary.simulated == pytest.approx([5e-4, 5e-4, usual.hand])
    delays = {"camera": {"error": None, "left": 3e-3}, "pose": {"error": 4e-4, "left": 4e-3}}
    delays["camera"]["against"] = "force"
    summary = Tolerances.of(SimpleNamespace(metadata={"preprocessing": {"delays": delays}}))
    assert (summary.camera, summary.pose) == (3e-3, 4e-3)
    delays = {"camera": {"left": 3e-4}, "pose": {"left": 4e-4, "against": "release"}}
    summary = Tolerances.of(
        SimpleNamespace(metadata={"preprocessing": {"release_error": 3e-4, "delays": delays}})
    )
    assert (summary.camera, summary.pose) == pytest.approx((5e-4, 5e-4)) and summary.release < 1e-4
    for empty in ({}, {"preprocessing": {"delays": None}}, {"preprocessing": {"delays": {}}}):
        assert Tolerances.of(SimpleNamespace(metadata=empty)) == usual


@dataclass
class Pads:
    grip_force: float = 50.0
    finger_opening_time: float = 0.004


def held(fall: float | None, force: float = 20.0) -> SimpleNamespace:
    """A hand that holds a force until 1 s, when it falls within `fall`."""
    time = np.arange(0, 1.3, 0.03)
    pull = np.where(time < 1, force, 0.0)
    metadata = {} if fall is None else {"preprocessing": {"release_fall": fall}}
    course = np.stack([0 * pull, 0.6 * pull, 0.8 * pull], axis=1)
    return SimpleNamespace(time=time, force=course, release_time=1.0, metadata=metadata)


def test_pads_that_open_linearly_let_the_force_fall_as_recorded():
    """Slip begins when 2 mu N (1 - t/T) is the held force; what then falls takes until T."""
    opening, step, friction = 0.006, 1e-7, 0.7
    time = np.arange(0, opening, step)
    most = 2 * friction * Pads.grip_force * (1 - time / opening)
    fall = step * np.count_nonzero(most < 20.0)

    def set_by(fall: float | None) -> float:
        return with_recorded_pads(Pads(), held(fall), friction).finger_opening_time

    assert set_by(fall) == pytest.approx(opening, rel=1e-3)
    assert [set_by(fall) for fall in (None, 1e-6, 1.0)] == [0.004, 5e-4, 0.05]


def test_what_repeats_itself_counts_as_fewer_samples() -> None:
    """White noise as it is; each value k times over as sqrt(k): the triangle of its correlation."""
    noise = np.random.default_rng(3).normal(0, 0.1, 4000)
    assert _repeated(noise) == pytest.approx(0.1, rel=0.1)
    for count in (5, 20):
        slow = np.repeat(noise[: 4000 // count], count)
        assert _repeated(slow) == pytest.approx(0.1 * np.sqrt(count), rel=0.25)
    assert _repeated(np.zeros(10)) == 0.0
