"""Which engine simulates the rollouts of a search, as a method's key `engine` names it.

Another engine than ours is a function `simulate(band, *, episode, parameters, device) -> Rollouts`
of whole batches: of a ClampedBand (simulator/model.py) with N Parameters (parameters.py);
the rollouts (interaction.py) stay on the host. It runs on one device, whichever it chooses.
"""

from __future__ import annotations

from importlib.metadata import entry_points
from typing import cast

from sling2sim2real.base.errors import UserError, one_line
from sling2sim2real.base.imported import imported, is_import
from sling2sim2real.identification.objective.evaluate import Simulate, simulated
from sling2sim2real.settings.identification import OUR_ENGINE

# Of entry points: engines that installed packages offer.
ENTRY_POINT_GROUP = "sling2sim2real.engines"


def simulate_of(engine: str) -> Simulate:
    """The function of an engine: OUR_ENGINE, an installed package's, or `package.module:function`.

    Raises UserError where there is no such function.
    """
    if engine == OUR_ENGINE:
        return simulated
    try:
        simulate = imported(engine if is_import(engine) else _installed(engine))
    except Exception as error:  # a module of the user's may raise anything
        message = one_line(f"{type(error).__name__}: {error}")
        raise UserError(f"engine {engine}: cannot be imported ({message})") from error
    if not callable(simulate):
        raise UserError(f"engine {engine}: must be a function; see docs/simulator.md")
    return cast(Simulate, simulate)


def _installed(engine: str) -> str:
    """Where an installed package has an engine, as `package.module:function`."""
    for entry in entry_points(group=ENTRY_POINT_GROUP, name=engine):
        return entry.value
    raise LookupError(
        f"no installed package has it among its {ENTRY_POINT_GROUP}; install this one anew"
    )
