"""Ask an exported policy for a draw, on a machine that does not have this project.

    python policy_elsewhere.py FOLDER TARGET      # such as data/policies/band1-posterior 1.925

Wants onnxruntime and NumPy alone. FOLDER holds policy.onnx and card.json, which a run exported.
"""

import json
import sys
from pathlib import Path

import numpy as np
import onnxruntime


def main(folder: str, target: str) -> None:
    card = json.loads(Path(folder, "card.json").read_text(encoding="utf-8"))
    policy = onnxruntime.InferenceSession(
        str(Path(folder, "policy.onnx")), providers=["CPUExecutionProvider"]
    )
    wanted, given = card["input"], card["output"]

    inputs = {wanted["name"]: np.array([[float(target)]], np.float32)}  # (batch, 1), metres
    if projectile := card.get("projectile"):  # a policy that sees it: (batch, 2), metres
        inputs[projectile["name"]] = np.array([projectile["trained_at"]], np.float32)
    draws = policy.run([given["name"]], inputs)[0]  # (batch, 2), metres
    y, z = draws[0].tolist()
    print(f"draw to y = {y:.3f} {given['unit']}, z = {z:.3f} {given['unit']}")
    print(f"frame: {given['frame']}; {given['meaning']}")

    # The network answers whatever it is asked: these are for you to check.
    low, high = wanted["trained_range"]
    if not low <= float(target) <= high:
        print(f"warning: trained for targets from {low:g} to {high:g} {wanted['unit']}")
    training, used = card["training"], card["made_with"]
    band, setup = used["bands"][card["band"]], used["setup"]
    if not training["converged"]:
        print(f"warning: did not converge ({training['criterion']})")
    print(f"the arm may hold {card['max_force_n']:g} N")
    print(
        f"band: {1e3 * band['mass']:g} g, {1e3 * band['diameter']:g} mm,"
        f" {band['rest_length']:g} m; fork: {setup['fork_width']:g} m wide, tips"
        f" {setup['fork_height']:g} m high; projectile: {1e3 * setup['projectile_mass']:g} g"
    )
    if hand := card["launch"]:
        print(f"draw in {hand['pull_time_s']:.1f} s, wait {hand['pause_s']:.1f} s, let go")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(*sys.argv[1:])
