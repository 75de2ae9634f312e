"""The rig's integrator against another library's: CVODE at `rig.tolerance`, SciPy's LSODA at 1e-8.

    python -m validation.campaigns.rig_integrators      # some minutes

Both follow the same rates, on the same compiled forces, from the same start: a recorded pull with
its release, and launches; of band1, of a band three times as soft, and of one with another law and
a network that flows. CVODE runs a second time, at 1e-9: it tells what of a difference is CVODE's
tolerance. Writes reports/validation/rig-integrators.json.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from importlib.metadata import version
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
from scipy.integrate import solve_ivp

from pipeline.base import errors
from pipeline.params import Params, load
from rig.physics import forces
from rig.physics.forces import NEAR
from rig.physics.launch import launch_from
from rig.physics.motion import HandMotion
from rig.physics.string import ElasticString
from rig.physics.world import string_of
from rig.recorder.interaction import Interaction, hang, pull_and_release
from validation.campaigns import runner
from validation.projects import with_section
from validation.reports import write_report

REPORT = Path("reports/validation/rig-integrators.json")
BAND = "band1"
FLOW = {"share": 0.3, "rate": 1000.0, "power": 5.0, "chain": -0.7, "offset": 0.01}
RUBBERS: dict[str, dict[str, Any]] = {  # what of rig.bands is otherwise
    "band1": {},
    "soft": {"peak_force": 4.06},
    "extended tube that flows": {"law": "extended_tube", "constants": [], "flow": FLOW},
}
TIGHT, TIGHTER = 1e-8, 1e-9  # relative tolerances: LSODA's, CVODE's second
DRAWS = np.array([(-0.27, -0.20), (-0.30, -0.15), (-0.33, -0.17)])  # (y, z) [m]
SENSOR_RATE, CAMERA_RATE = 1000, 30  # Hz
ASKED = {"force_n": 1e-3, "nodes_held_m": 2e-5, "nodes_swinging_m": 2e-5, "landing_m": 1e-4}
USERS = ("string", "launch", "servo", "rubber")  # modules of rig.physics that integrate


def lsoda(tight: float) -> Callable[..., tuple[np.ndarray, np.ndarray]]:
    """`rig.physics.integration.integrated` by SciPy's LSODA, at a tolerance of its own."""

    def integrated(rates, y, times, data, rtol, atol, *, event=None, max_step=np.inf, **_):
        def change(t: float, flat: np.ndarray) -> np.ndarray:
            out = np.empty_like(flat)
            rates(t, flat, out, data)
            return out

        options: dict[str, Any] = {"events": _falling(event, data)} if event else {}
        if rates is forces.rates:
            options |= banded(y.size, data)
        solution = solve_ivp(
            change,
            (times[0], times[-1]),
            y,
            method="LSODA",
            t_eval=times,
            rtol=tight,
            atol=atol * tight / rtol,
            max_step=max_step,
            **options,
        )
        if solution.status < 0:
            raise RuntimeError(f"LSODA: {solution.message}")
        instants, states = solution.t, solution.y.T
        if solution.status == 1:
            instants = np.append(instants, solution.t_events[0])
            states = np.vstack([states, solution.y_events[0]])
        return instants, states

    return integrated


def _falling(value: Callable[..., Any], data: Any) -> Callable[[float, np.ndarray], float]:
    def event(t: float, flat: np.ndarray) -> float:
        out = np.empty(1)
        value(t, flat, out, data)
        return float(out[0])

    event.terminal, event.direction = True, -1  # pyright: ignore[reportFunctionMemberAccess]
    return event


def banded(size: int, data: Any) -> dict[str, Any]:
    """The Jacobian of `forces.rates`, as LSODA takes one with a band."""
    nodes = len(data[0].masses)
    width = size // nodes
    reach = (NEAR + 1) * width - 1
    blocks = np.zeros((nodes, 2 * NEAR + 1, width, width))
    node, offset, row, column = np.indices(blocks.shape)
    rows, columns = node * width + row, (node + offset - NEAR) * width + column
    inside = (columns >= 0) & (columns < size)
    places = (rows - columns + reach)[inside], columns[inside]

    def jacobian(t: float, flat: np.ndarray) -> np.ndarray:
        forces.slopes(t, flat, blocks, data)
        packed = np.zeros((2 * reach + 1, size))
        packed[places] = blocks[inside]
        return packed

    return {"jac": jacobian, "lband": reach, "uband": reach}


@contextmanager
def by_lsoda(rtol: float) -> Iterator[None]:
    """All of the rig's physics integrates so."""
    with ExitStack() as stack:
        for name in USERS:
            stack.enter_context(patch(f"rig.physics.{name}.integrated", lsoda(rtol)))
        yield


def rubber(params: Params, changes: dict[str, Any]) -> Params:
    """Params with another rubber of BAND's."""
    band = params.rig.bands[BAND]
    other = type(band).model_validate(band.model_dump() | changes)
    return with_section(params, "rig", bands=params.rig.bands | {BAND: other})


def pulled(string: ElasticString, hanging: np.ndarray, params: Params) -> Interaction:
    """A recorded interaction from where the band hangs."""
    rng = np.random.default_rng(params.rig.seed)
    pads = params.rig.pads
    opening = pads.opening_time, pads.shape
    motion = HandMotion.through(hanging[string.middle], params.rig.tracking_error, opening, rng)
    sensed, seen = (
        np.arange(round(motion.end * rate)) / rate for rate in (SENSOR_RATE, CAMERA_RATE)
    )
    return pull_and_release(string, hanging, motion, sensed, seen, params)


def launched(string: ElasticString, params: Params, draws: np.ndarray = DRAWS) -> np.ndarray:
    """Where launches land [m]."""
    landings = [launch_from(string, params, np.array([0.0, *draw])).landing_y for draw in draws]
    if not np.isfinite(landings).all():
        raise RuntimeError(f"a launch fails: {landings}")
    return np.array(landings)


def apart(interaction: Interaction, other: Interaction) -> dict[str, float]:
    """Largest differences between two interactions."""
    far = np.linalg.norm(interaction.lines - other.lines, axis=-1).max(axis=1)
    slipped = interaction.seen > max(interaction.slip_time, other.slip_time)
    held = interaction.seen < min(interaction.slip_time, other.slip_time)
    # where both hold the band or neither does
    alike = (interaction.force != 0).any(axis=1) == (other.force != 0).any(axis=1)
    return {
        "force_n": float(np.linalg.norm(interaction.force - other.force, axis=-1)[alike].max()),
        "hand_m": float(np.linalg.norm(interaction.hand - other.hand, axis=-1).max()),
        "slip_s": abs(interaction.slip_time - other.slip_time),
        "nodes_held_m": float(far[held].max()),
        "nodes_swinging_m": float(far[slipped].max(initial=0.0)),
    }


def compared(params: Params, draws: np.ndarray = DRAWS) -> dict[str, Any]:
    """CVODE, CVODE at a tighter tolerance, and LSODA, on a rubber."""
    string = string_of(params, BAND)
    results: dict[str, tuple[Interaction, np.ndarray, float]] = {}
    hanging = hang(string, params.rig.tolerance)
    tighter = with_section(params, "rig", tolerance=TIGHTER)
    for name, its in (("cvode", params), ("tighter_cvode", tighter), ("lsoda", params)):
        begin = time.process_time()
        with by_lsoda(TIGHT) if name == "lsoda" else ExitStack():
            happened, landings = pulled(string, hanging, its), launched(string, its, draws)
        results[name] = happened, landings, time.process_time() - begin

    def between(integrator: str, other: str) -> dict[str, float]:
        landing = np.abs(results[integrator][1] - results[other][1]).max()
        return apart(results[integrator][0], results[other][0]) | {"landing_m": float(landing)}

    return {
        "cvode_against_lsoda": between("cvode", "lsoda"),
        "tighter_cvode_against_lsoda": between("tighter_cvode", "lsoda"),
        "cvode_against_tighter_cvode": between("cvode", "tighter_cvode"),
        "cpu_seconds": {name: round(result[2], 1) for name, result in results.items()},
    }


def report(params: Params, rubbers: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """Report on the rubbers that are compared."""
    most = {
        what: max(row["cvode_against_lsoda"][what] for row in rubbers.values()) for what in ASKED
    }
    missed = sorted(what for what, limit in ASKED.items() if most[what] > limit)
    return {
        "asked": "CVODE at rig.tolerance agrees with LSODA at 1e-8 on the same rates:"
        " force, nodes while held and while they swing slack, landing.",
        "limits": ASKED,
        "tolerance": {"cvode": params.rig.tolerance, "lsoda": TIGHT, "tighter_cvode": TIGHTER},
        "rubbers": {name: {"rig.bands": RUBBERS[name], **row} for name, row in rubbers.items()},
        "most": most,
        "missed": missed,
        "met": not missed,
    }


def main() -> None:
    args, params, rubbers = runner.parser(__doc__, REPORT).parse_args(), load(), {}
    versions = {name: version(name) for name in ("scikit-sundae", "numba")}
    for name, changes in RUBBERS.items():
        rubbers[name] = compared(rubber(params, changes))
        print(f"{name}: {rubbers[name]}", flush=True)
        written = write_report(args.report, report(params, rubbers), versions=versions)
    print(
        f"{args.report}: {'met' if written['met'] else 'missed: ' + ', '.join(written['missed'])}"
    )


if __name__ == "__main__":
    errors.run(main)
