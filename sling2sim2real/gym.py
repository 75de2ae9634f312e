"""A calibrated band as a Gymnasium environment (extra `gym`).

    import gymnasium
    import sling2sim2real.gym  # registers it

    env = gymnasium.make("sling2sim2real/Slingshot-v0", band="bands/mine")
    envs = gymnasium.make_vec("sling2sim2real/Slingshot-v0", num_envs=512, band="bands/mine")

policy/environment.py says what is observed, done and rewarded. One launch is one episode.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from sling2sim2real.api.identification import Identification
from sling2sim2real.api.model import Model
from sling2sim2real.base.errors import UserError
from sling2sim2real.launching.surface.simulated import SimulatedLandings
from sling2sim2real.policy.environment import SlingshotVectorEnv, projectile_start
from sling2sim2real.simulator.launch import Launches
from sling2sim2real.simulator.parameters import Parameters

ID = "sling2sim2real/Slingshot-v0"


def slingshots(
    band: str | Path | Model,
    num_envs: int = 1,
    *,
    randomize: bool = False,
    error: float | None = None,
    simulated: bool = False,
) -> SlingshotVectorEnv:
    """Launches of a band, `num_envs` at a time; targets and reward are its `policy` settings.

    Args:
        band: Its folder, or a θ file that `Identification.save` wrote, or a model.
        randomize: Whether each launch has one of the posterior's samples; it is simulated then.
        error: Standard deviation of the drawn position along each axis [m]; None: as in trials,
            `trials.actuation_error`.
        simulated: Whether launches are simulated, on SLING_DEVICE, and not read between 825 that
            are simulated once a model.

    Raises:
        UserError: There is no such band, or no sample of it.
    """
    model = band if isinstance(band, Model) else Identification.load(band)
    setup, params = model.settings.setup, model.settings.policy
    samples = getattr(model, "sampled", None) if randomize else None
    if randomize and samples is None:
        raise UserError("randomize: the band has no samples of θ; `sling fit` makes them")

    def launcher(draws: np.ndarray, theta: Parameters = model.parameters) -> Launches:
        return model.launches(draws, theta.values)

    if simulated or randomize:
        surface = SimulatedLandings(launcher, setup)
    else:
        surface = model.landing_map
    seen = params.state == "projectile_target"
    return SlingshotVectorEnv(
        surface,
        targets=params.targets,
        num_envs=num_envs,
        reward=params.reward,
        projectile=projectile_start(setup, model.band) if seen else None,
        error=model.settings.trials.actuation_error if error is None else error,
        samples=samples,
    )


class SlingshotEnv(gymnasium.Env):
    """One launch of `slingshots`, whose arguments it takes."""

    metadata = {"render_modes": []}

    def __init__(self, band: str | Path | Model, **options: Any) -> None:
        self.one = slingshots(band, **options)
        self.observation_space = self.one.single_observation_space
        self.action_space = self.one.single_action_space

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict]:
        """A new target, or that of `options["target"]` [m]. Raises UserError."""
        super().reset(seed=seed)
        observed, info = self.one.reset(seed=seed, options=options)
        return observed[0], info

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict]:
        """Launch; the episode ends. The last item is one row of SlingshotVectorEnv.step's."""
        _, reward, _, _, info = self.one.step(np.asarray(action)[None])
        told = {name: values[0] for name, values in info.items() if "final" not in name}
        return info["final_obs"][0], float(reward[0]), True, False, told


gymnasium.register(ID, entry_point=SlingshotEnv, vector_entry_point=f"{__name__}:slingshots")
