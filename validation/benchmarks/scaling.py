"""What several GPUs bring: the same work on one, two, four, ... of them, and whether it is equal.

Generations with their loss, launches, and one whole search. Every number that comes out is compared
with one device's, to the bit.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from pipeline.base.errors import UserError
from pipeline.base.machine import named
from pipeline.identify.objective.evaluate import Evaluation
from pipeline.identify.objective.loss import TERMS
from pipeline.identify.objective.session import load_episode
from pipeline.identify.results.mounting import sling_of_method
from pipeline.identify.search.history import History
from pipeline.identify.search.loop import latin_hypercube
from pipeline.params import Params, expect_known
from pipeline.simulator.launch import Launches, launch
from pipeline.simulator.model import LaunchSetup
from validation.benchmarks.methods import BUDGETS, evaluator, time_search
from validation.benchmarks.timing import REPEATS, seconds, timed
from validation.synthetic import DRAW, recorded_yardstick

GENERATIONS = (64, 80, 1024, 4096, 16384)  # rollouts: the paper's two, and big ones
LAUNCHES = (1024, 16384)


def bench_scaling(
    params: Params,
    device: str,
    band: str | None = None,
    method: str = "sling2sim2real",
    size: str = "laptop",
) -> dict:
    """Time it on the first of some devices, on two, four, ... and on all.

    Args:
        device: As SLING_DEVICE names them, two or more.
        band: Whose episode and mounting lie in data/; None takes the yardstick of `sling bench`.
        method: Whose search is timed, and in whose box the generations lie.
        size: Of the search's budget, laptop (params.yaml's) or large.

    Returns:
        `scaling`: of `generations` and `launches` their count, and of those and the `search` for
        each number of devices seconds, how many times as fast as one, and whether all is equal.

    Raises:
        UserError: Fewer than two devices, or an unknown band or method, or no episode of it.
    """
    devices = named(device, "--device")
    if len(devices) < 2:
        raise UserError(
            f"--scaling compares several GPUs with one; --device {device} is one device"
        )
    return scaling(params, devices, band, method, size)


def scaling(
    params: Params, devices: Sequence[str], band: str | None, method: str, size: str
) -> dict:
    """`bench_scaling` on devices that are there."""
    expect_known(params, "method", method)
    if band:
        expect_known(params, "band", band)
        sling, episode = sling_of_method(params, band, method), load_episode(band)
    else:
        sling, episode = recorded_yardstick(params)
    optimizer = params.optimizer.model_copy(update=BUDGETS[size])
    teams = [devices[:count] for count in _counts(len(devices))]
    evaluates = [evaluator(params, method, sling, episode, team) for team in teams]
    box = evaluates[0].box
    evaluates[-1](np.full((len(devices), box.dimension), 0.5))  # compiles

    def generation(count: int) -> dict:
        unit = latin_hypercube(box.dimension, count, optimizer.seed)
        works = [partial(evaluate, unit) for evaluate in evaluates]
        return {"rollouts": count} | _compared(works, teams, _evaluated)

    def launches(count: int) -> dict:
        unit = latin_hypercube(box.dimension, count, optimizer.seed)
        parameters = box.parameters(box.to_physical(unit))
        setup = LaunchSetup.of(params.setup, params.sling)
        work = partial(launch, sling, setup, parameters, [-DRAW, -0.15])
        works = [partial(work, device=team) for team in teams]
        return {"launches": count} | _compared(works, teams, _launched)

    def search() -> dict:
        rows, histories = zip(
            *(time_search(params, method, optimizer, sling, episode, team) for team in teams),
            strict=True,
        )
        numbers = [_searched(history) for history in histories]
        equal = [all(map(_same, number, numbers[0])) for number in numbers]
        return {"method": method, "budget": size, "one_device": rows[0]} | _row(
            teams, [row["seconds"] for row in rows], equal
        )

    return {
        "band": band or "yardstick",
        "scaling": {
            "generations": [generation(count) for count in GENERATIONS],
            "launches": [launches(count) for count in LAUNCHES],
            "search": search(),
        },
    }


def _counts(most: int) -> list[int]:
    """1, 2, 4, ... and `most`."""
    return sorted({2**power for power in range(most.bit_length())} | {most})


def _compared(
    works: list[Callable[[], object]], teams: list[Sequence[str]], numbers: Callable
) -> dict:
    """Measure each work's best time, and whether its numbers are the first one's."""
    first = numbers(works[0]())  # untimed: memory of this size has been asked for then
    walls, equal = [], []
    for work in works:
        result, _, wall = timed(work)
        walls.append(min(wall, seconds(work, REPEATS - 1)))
        arrays = numbers(result)
        equal.append(all(map(_same, arrays, first)))
    return _row(teams, walls, equal)


def _row(teams: list[Sequence[str]], walls: list[float], equal: list[bool]) -> dict:
    return {
        "devices": [
            {"count": len(team), "seconds": wall, "speedup": walls[0] / wall, "equal": same}
            for team, wall, same in zip(teams, walls, equal, strict=True)
        ]
    }


def _same(array: np.ndarray, other: np.ndarray) -> bool:
    return np.array_equal(array, other, equal_nan=array.dtype.kind == "f")


def _evaluated(evaluation: Evaluation) -> list[np.ndarray]:
    return [evaluation.total, *evaluation.terms.values(), np.array(evaluation.failure, str)]


def _searched(history: History) -> list[np.ndarray]:
    return [history.unit, history.total, *(history.table[name].to_numpy() for name in TERMS)]


def _launched(launches: Launches) -> list[np.ndarray]:
    return [
        launches.landing_y,
        launches.hold_force,
        launches.separation_time,
        np.array(launches.failure, str),
    ]


def table(result: dict) -> str:
    """What `bench_scaling` found, as lines for people."""
    parts = result["scaling"]
    rows = [(f"{row['rollouts']} rollouts", row) for row in parts["generations"]]
    rows += [(f"{row['launches']} launches", row) for row in parts["launches"]]
    rows.append(
        (f"{parts['search']['method']}, {parts['search']['budget']} budget", parts["search"])
    )
    width = max(len(name) for name, _ in rows)
    lines = [f"band {result['band']}", "  ".join([" " * width, "devices", "seconds", "speedup"])]
    for name, row in rows:
        for timing in row["devices"]:
            cells = f"{timing['count']:7}  {timing['seconds']:7.2f}  {timing['speedup']:7.2f}"
            lines.append(f"{name:{width}}  {cells}{'' if timing['equal'] else '  NOT EQUAL'}")
            name = ""
    return "\n".join(lines)
