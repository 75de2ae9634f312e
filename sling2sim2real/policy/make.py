"""Train, check and write a slingshot policy: the whole way from a calibrated simulator to ONNX."""

from __future__ import annotations

from sling2sim2real.base.machine import kind
from sling2sim2real.base.progress import Progress
from sling2sim2real.launching.surface.landing_map import LandingMap, Launcher
from sling2sim2real.launching.surface.simulated import SimulatedLandings
from sling2sim2real.launching.surface.stored import Stored
from sling2sim2real.policy.check import check, figures, verdict
from sling2sim2real.policy.environment import projectile_start
from sling2sim2real.policy.export import export
from sling2sim2real.policy.train import train
from sling2sim2real.settings import Settings
from sling2sim2real.simulator.model import LaunchHistory


def make_policy(
    stored: Stored,
    launcher: Launcher,
    params: Settings,
    band: str,
    method: str,
    theta: dict,
    *,
    history: LaunchHistory | None,
    progress: Progress | None = None,
) -> str:
    """Write a policy's network and card; return how it went.

    Args:
        stored: Where they are to lie.
        launcher: Simulates draws (N, 2) [m] of the calibrated band.
        params, band, method, theta: As `policy.export.card` has them.
        history: How the hand must draw the band, where its law remembers that.
        progress: Told of each iteration.
    """
    settings = params.policy
    setup = params.setup
    if settings.landings == "simulated":
        surface = SimulatedLandings(launcher, setup)
    else:
        box = {"draw_y": setup.draw_y, "draw_z": setup.draw_z, "max_force": setup.max_force}
        surface = LandingMap.simulate(launcher, **box, size=settings.map_size)
    seen = settings.state == "projectile_target"
    start = projectile_start(setup, params.bands[band]) if seen else None
    trained = train(surface, settings, progress, projectile=start)
    checked = check(trained.policy, launcher, params)
    training = figures(trained, checked, settings.landings)
    export(
        trained,
        stored,
        params,
        band,
        method,
        theta,
        training=training,
        history=history,
        device=kind(),
    )
    return verdict(training, checked.failures)
