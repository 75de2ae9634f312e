"""Settings of rsl_rl for PPO and its networks."""

from __future__ import annotations

from sling2sim2real.settings.launches import PolicyParams


def settings(params: PolicyParams, state: list[str]) -> dict:
    """Configuration of rsl_rl's algorithm.

    Args:
        params: The `policy:` section of params.yaml.
        state: Groups of observations that both networks see, in order.
    """
    network = {"class_name": "MLPModel", "hidden_dims": list(params.hidden), "activation": "elu"}
    exploration = {"class_name": "GaussianDistribution", "init_std": params.init_std}
    if params.exploration == "scheduled":  # else rsl_rl's default: one more parameter to learn
        exploration |= {"std_type": "log", "learn_std": False}
    return {
        "num_steps_per_env": params.steps,
        "multi_gpu": None,
        "obs_groups": {"actor": state, "critic": state},
        "actor": {**network, "distribution_cfg": exploration},
        "critic": dict(network),
        "algorithm": {
            "class_name": "PPO",
            "learning_rate": params.learning_rate,
            "gamma": 0.0,  # one step: the return is the reward
            "lam": 0.0,
            "entropy_coef": 0.0,
            "num_learning_epochs": 5,
            "num_mini_batches": 2,
            "schedule": "adaptive",
            "desired_kl": 0.01,
        },
    }
