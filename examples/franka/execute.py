"""Have a Franka do what `sling plan` or `sling aim` says, by franky (pip install franky-control).

    python execute.py plan --robot 172.16.0.2
    python execute.py plan --aim aim.json --robot 172.16.0.2

The first pulls a band for its recording: trajectory.csv, phase by phase. The second launches: it
grasps and lifts as in the plan, and draws to the pose of `sling aim --json`. Without --robot it
only says what it would do. Tried on a simulated Franka (README.md), never on a robot.
"""

from __future__ import annotations

import argparse
import csv
import json
import math
import sys
import time
from dataclasses import dataclass, replace
from pathlib import Path

FINGERS, WIDEST = 0.1, 0.08  # m/s, m: of a Franka's hand
OFF = 0.02  # rad that a joint may rest off its place; a drawn band moves it by less
SETTLE = 10  # tenths of a second that it gets for that
READY = [0.0, -0.3, 0.0, -2.2, 0.0, 3.47, 2.356]  # rad: the hand looks ahead, far from any limit
TURNED = -0.785  # joint 7 with --half-turn
SLOW = 0.05  # of the robot's own limits, on the way to where the plan begins
ONCE = "stretch", "slacken", "let back", "redraw"  # of a recording alone, not of a launch
NO_ROBOT = "fork"  # the frame of a plan that knows no robot


@dataclass(frozen=True)
class Leg:
    """One phase: a straight way with rest at both ends, or a rest.

    Attributes:
        position, quaternion: Of the tool centre point in the base at its end, m and x y z w.
        duration: s.
        opening: Distance of the fingers at its end [m].
        speed, acceleration: The largest of it, m/s and m/s^2; 0 for a rest.
    """

    name: str
    position: tuple[float, ...]
    quaternion: tuple[float, ...]
    duration: float
    opening: float
    speed: float
    acceleration: float


def legs_of(plan: Path) -> tuple[list[Leg], Leg]:
    """The phases of a plan's trajectory.csv, and where it begins."""
    if json.loads((plan / "plan.json").read_text())["frame"] == NO_ROBOT:
        raise ValueError(f"{plan}: is in frame O, not in a robot's base: `sling setup`, plan again")
    with (plan / "trajectory.csv").open(newline="") as file:
        rows = [
            {key: value if key == "phase" else float(value) for key, value in row.items()}
            for row in csv.DictReader(file)
        ]
    edges = [i for i in range(1, len(rows)) if rows[i]["phase"] != rows[i - 1]["phase"]]
    fingers = openings(plan)
    legs = []
    for first, last in zip([0, *edges], [*edges, len(rows) - 1], strict=True):
        part, end = rows[first:last], rows[last]
        legs.append(
            Leg(
                part[0]["phase"],
                tuple(end[k] for k in ("x", "y", "z")),
                tuple(end[k] for k in ("qx", "qy", "qz", "qw")),
                end["t"] - part[0]["t"],
                [gap for at, gap in fingers if at < part[0]["t"] + 0.001][-1],
                max(math.hypot(r["vx"], r["vy"], r["vz"]) for r in part),
                max(math.hypot(r["ax"], r["ay"], r["az"]) for r in part),
            )
        )
    start = rows[0]
    place = tuple(start[k] for k in ("x", "y", "z"))
    turn = tuple(start[k] for k in ("qx", "qy", "qz", "qw"))
    return legs, Leg("start", place, turn, 0.0, fingers[0][1], 0.0, 0.0)


def openings(plan: Path) -> list[tuple[float, float]]:
    """Times at which the fingers are commanded [s], and their distances [m], by gripper.json."""
    commands = []
    for load in json.loads((plan / "gripper.json").read_text()):
        at, gap = load["time_from_start"], 2 * load["command"]["position"]
        if not 0 <= gap <= WIDEST + 1e-9:
            raise ValueError(
                f"{plan}: a Franka's hand opens from 0 to {WIDEST} m, not to {gap:g}: plan with"
                " plan.gripper.position: finger"
            )
        commands.append((at["sec"] + 1e-9 * at["nanosec"], gap))
    return commands


def aimed(legs: list[Leg], aim: Path) -> list[Leg]:
    """Up to the first release, with the draw, its time and its pause as `sling aim` has them."""
    answer = json.loads(aim.read_text())
    if "refused" in answer:
        raise ValueError(f"{aim}: {answer['refused']}")
    if answer["tcp_position_m"] is None:
        raise ValueError(f"{aim}: has no pose in the robot's base: `sling setup`, aim again")
    if answer["hold_force_n"] is None or answer["hold_force_n"] > answer["max_force_n"]:
        raise ValueError(f"{aim}: the draw takes more than setup.max_force: aim nearer")
    release = next(i for i, leg in enumerate(legs) if leg.name == "release")
    place, turn = tuple(answer["tcp_position_m"]), tuple(answer["tcp_quaternion_xyzw"])
    times = answer.get("pull_and_pause_s") or [None, None]
    done = []
    for leg in legs[: release + 2]:
        if leg.name in ONCE or (leg.name == "pull" and done[-1].name == "pull"):
            continue
        if leg.name == "lift":
            leg = replace(leg, quaternion=turn)
        elif leg.name in ("pull", "pause", "release", "swing"):
            leg = replace(leg, position=place, quaternion=turn)
        if leg.name == "pull":
            duration = times[0] or leg.duration
            way = math.dist(done[-1].position, place)
            speed, acceleration = 2 * way / duration, 8 * way / duration**2
            leg = replace(leg, duration=duration, speed=speed, acceleration=acceleration)
        elif leg.name == "pause":
            leg = replace(leg, duration=times[1] or leg.duration)
        done.append(leg)
    return done


def half_turned(leg: Leg) -> Leg:
    """The hand turned about the way it looks, which holds the band as well."""
    x, y, z, w = leg.quaternion
    return replace(leg, quaternion=(y, -x, w, -z))


class Arm:
    """A Franka and its hand."""

    def __init__(self, host: str, threshold: float, realtime: bool) -> None:
        import franky

        self.franky = franky
        config = franky.RealtimeConfig.Enforce if realtime else franky.RealtimeConfig.Ignore
        self.robot = franky.Robot(host, realtime_config=config)
        self.hand = franky.Gripper(host)
        self.robot.recover_from_errors()
        self.robot.set_collision_behavior(threshold, threshold)  # Nm, N: a drawn band pulls
        self.pending = None

    def begin(self, start: Leg, half_turn: bool) -> None:
        """Open, and go slowly to where the plan begins, by way of READY."""
        self.hand.move(start.opening, FINGERS)
        self.robot.relative_dynamics_factor = SLOW
        ready = [*READY[:6], TURNED] if half_turn else READY
        self.robot.move(self.franky.JointMotion(ready))
        self.robot.move(self._to(start))
        self.robot.relative_dynamics_factor = 1.0
        self.expect(start)

    def expect(self, leg: Leg) -> None:
        """Raises RuntimeError where a joint does not follow what it was told."""
        for _ in range(SETTLE):
            state = self.robot.state
            off = [
                abs(float(q) - float(summary))
                for q, summary in zip(state.q, state.q_d, strict=True)
            ]
            if max(off) <= OFF:
                return
            time.sleep(0.1)
        raise RuntimeError(
            f"the {leg.name}: joint {1 + off.index(max(off))} is {max(off):.2f} rad from where it"
            " should be: its limit, or something in the way; try --half-turn, or put the fork"
            " elsewhere (README.md)"
        )

    def go(self, leg: Leg, opening: float, force: float) -> None:
        """One phase; the fingers had `opening` before it."""
        began = time.monotonic()
        if leg.opening < opening:
            # a band is no hard object: any width is a grasp
            self.pending = self.hand.grasp_async(leg.opening, FINGERS, force, WIDEST, WIDEST)
        elif leg.opening > opening:
            self.pending = self.hand.move_async(leg.opening, FINGERS)
        if leg.speed:
            self.robot.translation_velocity_limit.set(leg.speed)
            self.robot.translation_acceleration_limit.set(leg.acceleration)
            self.robot.move(self._to(leg))  # within the plan's time; then it rests for what is left
        time.sleep(max(0.0, began + leg.duration - time.monotonic()))
        self.expect(leg)
        if leg.opening < opening and not (self.pending.wait(2.0) and self.pending.get()):
            raise RuntimeError("the fingers did not close on the band")

    def _to(self, leg: Leg):
        """A straight motion to rest at the leg's end."""
        f = self.franky
        state = f.CartesianState(f.RobotPose(f.Affine(leg.position, leg.quaternion)))
        return f.CartesianWaypointMotion([f.CartesianWaypoint(state)])


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description="Have a Franka follow a plan, or an aim.")
    parser.add_argument("plan", type=Path, help="folder of `sling plan`")
    parser.add_argument("--aim", type=Path, metavar="FILE", help="answer of `sling aim --json`")
    parser.add_argument("--robot", metavar="HOST", help="its address; without it nothing moves")
    parser.add_argument("--half-turn", action="store_true", help="of the hand, for its joints")
    parser.add_argument("--threshold", type=float, default=60.0, help="of a collision [N, Nm]")
    parser.add_argument("--no-realtime", action="store_true", help="on a kernel without PREEMPT_RT")
    parser.add_argument("--yes", action="store_true", help="do not ask")
    summary = parser.parse_args(arguments)
    try:
        legs, start = legs_of(summary.plan)
        legs = aimed(legs, summary.aim) if summary.aim else legs
        if summary.half_turn:
            start, *legs = map(half_turned, [start, *legs])
        command = json.loads((summary.plan / "gripper.json").read_text())[0]["command"]
    except (OSError, ValueError, KeyError, IndexError, StopIteration) as error:
        message = f"{summary.plan}: lacks {error}" if isinstance(error, KeyError) else error
        print(f"error: {message}", file=sys.stderr)
        return 1
    for leg in (start, *legs):
        place = " ".join(f"{value:+.4f}" for value in leg.position)
        print(f"{leg.name:<10}{leg.duration:7.3f} s   {place}   fingers {leg.opening:.3f} m")
    if summary.robot is None:
        return 0
    if not summary.yes and input("a hand at the stop, nobody near? [yes] ").strip() != "yes":
        return 1
    try:
        arm = Arm(summary.robot, summary.threshold, not summary.no_realtime)
        arm.begin(start, summary.half_turn)
        opening = start.opening
        for leg in legs:
            arm.go(leg, opening, command["max_effort"])
            opening = leg.opening
    except (ImportError, RuntimeError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
