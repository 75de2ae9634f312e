"""`sling bench`: rollouts (with the loss and without) and launches that are simulated a second.

python -m validation.bench [--device cpu] [--law rubber] [--json]
"""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
from scipy.stats import qmc

from pipeline.params import Params, load
from sling2sim2real.base import errors
from sling2sim2real.base.machine import named
from sling2sim2real.cli.command_line import Parser
from sling2sim2real.identification.objective.box import SearchBox
from sling2sim2real.identification.objective.evaluate import Evaluator
from sling2sim2real.identification.objective.loss import EpisodeLoss
from sling2sim2real.simulator.interaction import Rollouts, interact, schedule_of
from sling2sim2real.simulator.launch import Launches, launch
from sling2sim2real.simulator.model import LaunchSetup
from sling2sim2real.simulator.parameters import Parameters
from sling2sim2real.simulator.records import Grip
from sling2sim2real.simulator.rubber import NEO_HOOKEAN, RUBBER
from sling2sim2real.simulator.schedule import RELAX_STEPS
from sling2sim2real.simulator.solver import Options, memory
from validation.reports import environment
from validation.synthetic import DRAW, recorded_yardstick

REPEATS = 3  # the best of them counts: others may use the machine too
BATCHES = {"cpu": (64, 256), "cuda": (64, 1024, 16384)}
BOXES = {  # of what a law adds to params.yaml's parameters
    NEO_HOOKEAN: {},
    RUBBER: {"mooney_share": (-0.3, 0.9), "relaxation": (0.0, 0.05)},
}


def bench(params: Params, device: str = "cpu", law: str = NEO_HOOKEAN) -> dict:
    """Time the yardstick.

    Args:
        device: As SLING_DEVICE names it.
        law: Of the simulated band.

    Returns:
        `law`; `batches`: environments, threads on the CPU, seconds and rollouts/s without and with
        the loss, launches/s; `yardstick`: its steps, the mean of its Newton iterations, bytes a
        rollout.

    Raises:
        UserError: There is no such device.
    """
    device = named(device, "--device")
    kind = device.partition(":")[0]
    sling, episode = recorded_yardstick(params)
    sling, setup = replace(sling, law=law), LaunchSetup.of(params.setup, params.sling)
    box = SearchBox.of(params.parameters, bounds=BOXES[law], law=law)
    loss = EpisodeLoss.of(params, next(iter(params.methods)), episode, sling)

    def simulate(parameters: Parameters, **options) -> Rollouts:
        return interact(sling, episode, parameters, device=device, fetch=False, **options)

    def shoot(parameters: Parameters, **options) -> Launches:
        return launch(
            sling, setup, parameters, np.array([[-DRAW, -0.15]]), device=device, **options
        )

    batches = []
    for count in BATCHES[kind]:
        unit = qmc.LatinHypercube(box.dimension, rng=1).random(count)
        points = box.parameters(box.to_physical(unit))
        for workers in sorted({1, os.cpu_count() or 1} if kind == "cpu" else {1}):
            evaluate = Evaluator(episode, sling, loss, box, device=device, workers=workers)
            evaluate(unit[:1]), shoot(points[:1])  # what compiles
            alone = seconds(partial(simulate, points, workers=workers))
            with_loss = seconds(partial(evaluate, unit))
            batches.append(
                {
                    "environments": count,
                    "threads": workers,
                    "rollouts_s": alone,
                    "rollouts_with_loss_s": with_loss,
                    "rollouts_per_s": count / alone,
                    "rollouts_with_loss_per_s": count / with_loss,
                    "launches_per_s": count / seconds(partial(shoot, points, workers=workers)),
                }
            )
    iterations = simulate(points).iterations.mean()
    schedule = schedule_of(sling, episode)
    return {
        "law": law,
        "batches": batches,
        "yardstick": {
            "steps": steps_of(schedule),
            "newton_iterations": round(float(iterations)),
            "bytes_a_rollout": memory(sling, schedule, len(episode.cloud_time), Options(device)),
        },
    }


def steps_of(schedule) -> dict[str, int]:
    """How many steps each phase of a schedule has."""
    h, grip = schedule.steps["h"][RELAX_STEPS:], schedule.steps["grip"][RELAX_STEPS:]
    free = grip == Grip.FREE
    fine = free & (h <= h[free][0] * 1.001)
    return {
        "relaxation": RELAX_STEPS,
        "held": int((grip == Grip.HELD).sum()),
        "fingers_opening": int((grip == Grip.OPENING).sum()),
        "recoil": int(fine.sum()),
        "swing": int((free & ~fine).sum()),
    }


def table(result: dict) -> str:
    """What `bench` found, as lines for people."""
    rows = result["batches"]
    lines = ["  ".join(rows[0])]
    for row in rows:
        digits = {name: 2 if name.endswith(("rollouts_s", "loss_s")) else 0 for name in row}
        cells = [f"{value:{len(name)}.{digits[name]}f}" for name, value in row.items()]
        lines.append("  ".join(cells))
    steps, yardstick = result["yardstick"]["steps"], result["yardstick"]
    lines += [
        "",
        "a rollout: " + ", ".join(f"{name} {n}" for name, n in steps.items()) + " steps;",
        f"{yardstick['newton_iterations']} Newton iterations;"
        f" {yardstick['bytes_a_rollout'] / 1024:.0f} KiB",
    ]
    return "\n".join(lines)


def seconds(run: Callable[[], object]) -> float:
    """Wall time of the best of some runs."""
    times = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return min(times)


def parser() -> Parser:
    """Command line of `sling bench`."""
    parser = Parser(prog="sling bench", description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--device", default="cpu", help="cpu (default), or a GPU such as cuda:0")
    parser.add_argument("--law", choices=BOXES, default=NEO_HOOKEAN, help="of the band")
    parser.add_argument("--json", action="store_true", help="print one JSON object, not text")
    return parser


def main() -> None:
    given = parser().parse_args()
    result = bench(load(), given.device, given.law)
    if not given.json:
        print(table(result))
        return
    command = f"sling bench --law {given.law} --device {given.device} --json"
    print(json.dumps(environment(given.device, command) | result, indent=2))


if __name__ == "__main__":
    errors.run(main)
