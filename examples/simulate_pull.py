"""Simulate a pull, and see what each parameter changes in it.

    python examples/simulate_pull.py

No recording is needed: the hand's path is planned, the parameters are written by hand.
"""

from dataclasses import replace

import numpy as np

import sling2sim2real as s2s

BAND = s2s.Band(mass=0.023, diameter=0.010, rest_length=0.52)  # kg, m, m
THETA = s2s.Theta(
    youngs_modulus=2.2e5,  # Pa
    poissons_ratio=0.47,
    elasticity_damping=2.4e-3,  # s
    dynamic_friction=0.7,
    damping_scale=0.6,
    mooney_share=0.3,  # with one of these the material is a rubber, which relaxes while it is held
    relaxation=0.02,
)


def main() -> None:
    model = s2s.Model(BAND, THETA)
    planned = s2s.pull(model, draw=(-0.40, -0.10), frame_rate=500)
    thetas = {
        "as it is": THETA,
        "10 % stiffer": replace(THETA, youngs_modulus=1.1 * THETA.youngs_modulus),
        "relaxing twice as much": replace(THETA, relaxation=2 * THETA.relaxation),
        "damped ten times as much": replace(THETA, elasticity_damping=2.4e-2),
    }
    simulations = s2s.simulate_batch(model, planned, list(thetas.values()))
    print(f"{'':26} peak force  held force  recoil")
    for name, simulation in zip(thetas, simulations, strict=True):
        if simulation.failure:
            print(f"{name:26} {simulation.failure}")
            continue
        size = np.linalg.norm(simulation.force, axis=1)  # (T,)
        held = size[simulation.time < planned.release_time - 0.1][-1]
        swung = 1e3 * recoil(simulation, planned)
        print(f"{name:26} {size.max():8.2f} N {held:9.2f} N {swung:5.0f} ms")


def recoil(simulated: s2s.Simulation, planned: s2s.Episode) -> float:
    """Seconds from the release until the band's middle passes the fork."""
    middle = simulated.center_line[:, simulated.center_line.shape[1] // 2, 1]  # y, (K,)
    later = (simulated.cloud_time > planned.release_time) & (middle >= 0)
    return float(simulated.cloud_time[later][0] - planned.release_time)


if __name__ == "__main__":
    main()
