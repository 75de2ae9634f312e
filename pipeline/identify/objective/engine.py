"""Which engine simulates the rollouts of a search, as a method's key `engine` names it.

Another engine than ours is a function `simulate(band, *, episode, parameters, device) -> Rollouts`
of whole batches: of a ClampedBand (pipeline/simulator/model.py) with N Parameters (parameters.py);
the rollouts (interaction.py) stay on the host. It runs on one device, whichever it chooses.
"""

from __future__ import annotations

import inspect
from pathlib import Path

from pipeline.base.errors import UserError, one_line
from pipeline.base.imported import imported
from pipeline.identify.objective.evaluate import simulated
from pipeline.params.identification import OUR_ENGINE

KNOWN = {"physx": "validation.engines.physx.rollouts:simulate"}


def simulate_of(engine: str):
    """The function of an engine: OUR_ENGINE, one of KNOWN, or a user's `package.module:function`.

    Raises UserError where there is no such function.
    """
    if engine == OUR_ENGINE:
        return simulated
    try:
        found = imported(KNOWN.get(engine, engine))
    except Exception as error:  # a module of the user's may raise anything
        said = one_line(f"{type(error).__name__}: {error}")
        raise UserError(f"engine {engine}: cannot be imported ({said})") from error
    if not callable(found):
        raise UserError(f"engine {engine}: must be a function; see docs/simulator.md")
    return found


def sources_of(engine: str) -> list[Path]:
    """The folder of another engine's code, which its rollouts hang on; none for ours."""
    if engine == OUR_ENGINE:
        return []
    return [Path(inspect.getsourcefile(simulate_of(engine))).parent]
