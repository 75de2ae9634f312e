"""Which engine simulates the rollouts of a search, as a method's key `engine` names it.

Another engine than ours is a function `simulate(sling, *, episode, thetas, device) -> Rollouts` of
whole batches: thetas have shape (N, 5); the rollouts (pipeline/simulator/interaction.py) stay on
the host. It runs on one device, whichever it chooses.
"""

from __future__ import annotations

import inspect
from pathlib import Path
from typing import cast

from pipeline.base.errors import UserError, one_line
from pipeline.base.imported import imported
from pipeline.identify.objective.evaluate import Simulate, simulated
from pipeline.params.identification import OUR_ENGINE

KNOWN = {"physx": "validation.engines.physx.rollouts:simulate"}


def simulate_of(engine: str) -> Simulate:
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
    return cast(Simulate, found)


def sources_of(engine: str) -> list[Path]:
    """The folder of another engine's code, which its rollouts hang on; none for ours."""
    if engine == OUR_ENGINE:
        return []
    source = inspect.getsourcefile(simulate_of(engine))
    if source is None:
        raise UserError(f"engine {engine}: must be a function of Python, in a file of its own")
    return [Path(source).parent]
