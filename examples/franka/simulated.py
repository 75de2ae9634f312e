"""Try execute.py on a simulated Franka: pip install franky-control franky-sim, in an environment
of its own.

    python simulated.py plan [--aim aim.json]

MuJoCo moves the arm; there is no band. Beside what execute.py prints, it prints one JSON line: what
the simulator itself says of where the hand came to rest, and of its fingers.
"""

import json
import sys
import threading
import time

import execute
from franky_sim import SimulationServer
from franky_sim.mujoco_simulator import MujocoSimulator


def main() -> int:
    with MujocoSimulator() as simulator:
        robot, track, done = simulator.add_robot(), [], threading.Event()

        def watch() -> None:
            while not done.wait(0.002):
                track.append((robot.data.time, robot.inner_state.q, robot.hand_width))

        with SimulationServer(simulator) as server:
            server.run_async()
            time.sleep(0.5)
            watcher = threading.Thread(target=watch)
            watcher.start()
            there = ["--robot", robot.hostname, "--no-realtime", "--yes"]
            status = execute.main([*sys.argv[1:], *there])
            done.set()
            watcher.join()
        # only now: the server's own thread works with the same kinematics
        moved = [[t, *robot.kinematics(q).translation.tolist(), width] for t, q, width in track]
    print(json.dumps({"status": status, "track": moved}))
    return status


if __name__ == "__main__":
    sys.exit(main())
