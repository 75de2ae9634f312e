"""A band by `gymnasium.make`: the checker's rules, and the launches of the band itself."""

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from sling2sim2real import Band, Identification, Model, Settings, Theta, UserError, gym

BAND = Band(mass=0.023, diameter=0.010, rest_length=0.52)
THETA = Theta(2.2e5, 0.47, 2.4e-3, 0.7, 0.6)


@pytest.fixture(scope="module")
def band(tmp_path_factory) -> str:
    """As a file, with two samples."""
    settings = Settings.coarse(policy={"map_size": [5, 5], "state": "projectile_target"})
    samples = THETA.point * np.array([[0.9], [1.1]]) ** np.array(THETA.point > 1e3)
    path = tmp_path_factory.mktemp("gym") / "theta.json"
    Identification(BAND, THETA, settings=settings, samples=samples).save(path)
    return str(path)


@pytest.mark.filterwarnings("error::UserWarning")
@pytest.mark.parametrize("randomize", [False, True])
def test_the_checker_has_no_objection(band, randomize: bool) -> None:
    check_env(gymnasium.make(gym.ID, band=band, randomize=randomize).unwrapped)


def test_it_launches_the_band(band) -> None:
    """Read off the map or simulated, alone or many, as `Model.launches` does."""
    model = Identification.load(band)
    actions = np.array([[0.0, 0.0], [-0.5, 0.5]])
    options = {"band": model, "error": 0.0, "simulated": True}
    envs = gymnasium.make_vec(gym.ID, num_envs=2, **options)
    envs.reset(seed=1)
    *_, info = envs.step(actions)
    truth = model.launches(info["draw"]).landing_y
    np.testing.assert_array_equal(info["landing"], truth)
    one = gymnasium.make(gym.ID, **options | {"simulated": False})
    seen, _ = one.reset(options={"target": 1.925})
    assert one.observation_space.contains(seen) and seen[-1] == pytest.approx(0, abs=1e-6)
    final, reward, ended, truncated, info = one.step(actions[0])
    assert (final == seen).all() and ended and not truncated
    assert info["landing"] == pytest.approx(truth[0], abs=0.02)
    assert reward == pytest.approx(5 * np.exp(-abs(info["landing"] - 1.925)))
    random = gymnasium.make_vec(gym.ID, num_envs=8, band=model, error=0.0, randomize=True)
    random.reset(seed=1)
    landings = random.step(np.zeros((8, 2)))[-1]["landing"]
    np.testing.assert_allclose(
        np.unique(landings), model.launches(info["draw"], model.samples).landing_y
    )


def test_what_it_refuses() -> None:
    with pytest.raises(UserError, match="nowhere"):
        gymnasium.make(gym.ID, band="nowhere")
    with pytest.raises(UserError, match="^randomize: the band has no samples of θ"):
        gymnasium.make(gym.ID, band=Model(BAND, THETA), randomize=True)
