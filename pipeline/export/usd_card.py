"""The card of a USD export: what it is, and what it is not."""

from __future__ import annotations

FIVE = (
    "youngs_modulus",
    "elasticity_damping",
    "damping_scale",
    "poissons_ratio",
    "dynamic_friction",
)


def readme(card: dict) -> str:
    """README.md."""
    young, damping = (row["value"] for row in card["matched"])
    errors = [100 * one for one in card["tension_errors"]]
    stretches = card["stretches"]
    identified = {row["name"]: row["value"] for row in card["values"]}
    e, d, s, nu, mu = (identified[one] for one in FIVE)
    (name,) = (one for one in card["files"] if one.endswith(".usda"))
    return f"""\
# {card["band"]} for PhysX (Isaac Sim, Isaac Lab)

**Match it before you rely on it.** A stage like this one opened in PhysX 0.7, and its clamps held,
but drawn it held 37 to 72 % less than the calibrated simulation (export-usd.json of the project).
PhysX stops iterating before it has converged, so that what it holds depends on mesh, time step and
iterations; the modulus here is matched by PhysX's law on paper. Hold a draw and launch there, and
compare with the launches that `sling export --to yaml` writes.

`{name}` has the scene, the material, the band as {card["tetrahedra"]} tetrahedra that hang between
two clamps, and the clamps' attachments. Hand, projectile and pouch are yours to add.
{card["frames"]}

- Young's modulus: {young:.4g} Pa, matched as below; {e:.4g} Pa was identified.
- Damping: {1e3 * damping:.3g} ms, not matched; identified were {1e3 * d:.3g} ms,
  of which shape takes a share of {s:.2g}.
- Poisson's ratio {nu:.3g} and friction {mu:.3g} are as identified.

**What the match leaves, by the law of both.** PhysX's law is stiffer than rubber the more it is
stretched. With one modulus, a straight string of it pulls by {min(errors):+.0f} to
{max(errors):+.0f} % off at stretches from {min(stretches):.2f} to {max(stretches):.2f}, where the
launches around the targets are. Relaxation, Mooney's share, the damping scale, the rotational
damping share and the returned share have no slot, and nothing stands in for them.

**Time step.** {1e3 * card["time_step_s"]:g} ms and {card["iterations"]} iterations are the paper's.
Steps of this length lose launch speed.
"""
