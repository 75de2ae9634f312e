"""Bands as cables that Newton imports from USD: what they hold there, and where they land.

    python -m validation.engines.newton_cable [BAND...]

`ModelBuilder.add_usd` reads a linear curve as rigid rods between joints, which SolverVBD steps. A
joint pulls in proportion to its gap (evaluate_rod_stretch_shear_force_hessian of Newton 1.8): the
cable is a linear spring with a stiffness EA and a rest length. It has no upturn, no relaxation, no
softening. Three such cables of each band are drawn and launched, on the CPU, and compared with the
calibrated simulation. Writes reports/validation/export-newton-cable.json, and the table of
docs/export.md.
"""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Sequence
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from pipeline.base import errors
from pipeline.base.errors import UserError
from pipeline.export.band import CalibratedBand
from pipeline.export.card import ASKED, compared_row
from pipeline.export.chain import SpringChain
from pipeline.export.match import compared, draws_of, proof_draws, within_limits
from pipeline.export.replay import Shot
from pipeline.params import load
from pipeline.simulator.launch import ballistic_landing
from pipeline.simulator.model import GRAVITY
from sling2sim2real.identification import Identification
from validation.engines.physx.exported import yielded
from validation.engines.physx.scene import tuples
from validation.marked import block_of, fill, row
from validation.reports import write_report

REPORT, PAGE = Path("reports/validation/export-newton-cable.json"), Path("docs/export.md")
SETTLE, SETTLE_STEPS, BRAKE = 1e-3, 200, 5e-3  # step [s], steps, damping time [s]
STEP, STEPS = 1e-4, 800  # step of a launch [s], and how many: all have left by then
ITERATIONS = 20
VARIANTS = "identified", "stiffness matched", "stiffness and rest length matched"
THREAD = 1e-7  # of EA: bending and twisting [m^2], next to nothing


def cables(model: CalibratedBand) -> dict[str, SpringChain]:
    """Cables of a band by VARIANTS; `strength` is EA [N], `mooney_share` and `upturn` mean nothing.

    With the identified E and rest length; with the stiffness that holds nearest; and with the
    stiffness and the rest length that do.
    """
    draws, ours = draws_of(model)
    tension, stretch = SpringChain.tension(model, draws, ours.hold_force)
    chain = SpringChain.of(model, draws, ours.hold_force)
    area, same = np.pi * model.band.diameter**2 / 4, np.ones_like(tension)
    strain, both = (stretch - 1) / tension, np.stack([stretch, same], axis=1) / tension[:, None]
    slope, constant = np.linalg.lstsq(both, same, rcond=None)[0]  # tension, by relative errors
    rest = float(-constant / slope * chain.rest_length)
    return dict(
        zip(
            VARIANTS,
            (
                replace(chain, strength=model.parameters.sample()["youngs_modulus"] * area),
                replace(chain, strength=float(strain.sum() / (strain @ strain))),
                replace(chain, strength=float(-constant), rest_length=rest),
            ),
            strict=True,
        )
    )


def stage(chain: SpringChain, radius: float, place: np.ndarray, *, held: bool) -> str:
    """A band drawn to `place` (3,), as USD: cable, clamps, and a pouch that is led if `held`."""
    rest = np.zeros((chain.edges + 1, 3))
    rest[:, 0] = np.linspace(-chain.rest_length / 2, chain.rest_length / 2, len(rest))
    stiffness = chain.strength * (1 - 1 / chain.edges)  # n rods have n - 1 joints
    return STAGE % {
        "gravity": GRAVITY,
        "stretch": stiffness,
        "thread": THREAD * stiffness,
        "damping": (BRAKE if held else chain.damping_time) * stiffness,
        "count": len(rest),
        "points": tuples(chain.drawn(place), ".9g"),
        "rest": tuples(rest, ".9g"),
        "mass": chain.mass,
        "thickness": 2 * radius,
        "held": held,
        "projectile": chain.projectile_mass,
        "place": tuples(place[None], ".9g")[1:-1],
        "last": chain.edges,
        "middle": chain.edges // 2,
        "tips": tuples(chain.tips, ".9g"),
    }


class Cables:
    """N imported cables, stepped together; nothing collides. Raises UserError without Newton."""

    def __init__(self, stages: Sequence[str], step: float):
        """Args:
        step: Of time [s].
        """
        try:
            import newton
            import newton.solvers
            import newton_usd_schemas  # noqa: F401  add_usd wants it
            from pxr import Usd
        except ImportError as error:
            cure = "pip install -e '.[validation]' -c constraints.txt"
            raise UserError(f"newton's USD import is not installed: {cure}") from error
        builder, self.joints, pouches = newton.ModelBuilder(), [], []
        for text in stages:
            opened = Usd.Stage.CreateInMemory()
            opened.GetRootLayer().ImportFromString(text)
            with warnings.catch_warnings():  # SolverVBD has no use for a cable's free joint
                warnings.filterwarnings("ignore", ".*FREE joint parallel.*")
                there = builder.add_usd(opened, return_deformable_results=True)
            self.joints.append(there["path_cable_map"]["/World/Band"][1])
            pouches.append(there["path_body_map"]["/World/Pouch"])
        builder.color()
        self.model, self.pouches, self.step = builder.finalize(device="cpu"), pouches, step
        self.solver = newton.solvers.SolverVBD(self.model, iterations=ITERATIONS)
        self.states = [self.model.state(), self.model.state()]

    def advance(self) -> None:
        """One step."""
        now, after = self.states
        self.solver.step(now, after, self.model.control(), None, self.step)
        self.states = [after, now]

    def put(self, other: Cables) -> None:
        """Where the same cables are in `other`, at rest."""
        for state in self.states:
            state.body_q.assign(other.states[0].body_q)
            state.body_qd.zero_()

    def forces(self) -> np.ndarray:
        """Force of each cable at rest on its pouch, weights included [N], shape (N, 3)."""
        middle = len(self.joints[0]) // 2
        beside = np.array(self.joints)[:, [middle - 1, middle + 1]]  # left and right of the pouch
        parents, children = (
            joints.numpy()[beside] for joints in (self.model.joint_parent, self.model.joint_child)
        )
        gap = self._anchors(children, self.model.joint_X_c, beside)
        gap -= self._anchors(parents, self.model.joint_X_p, beside)
        along = self.model.joint_qd_start.numpy()[beside] + 2
        left, right = np.moveaxis(self.model.joint_target_ke.numpy()[along][..., None] * gap, 1, 0)
        bodies = np.column_stack([children[:, 0], parents[:, 1], self.pouches])
        weight = GRAVITY * self.model.body_mass.numpy()[bodies].sum(axis=1)
        return right - left - weight[:, None] * [0.0, 0.0, 1.0]

    def _anchors(self, bodies: np.ndarray, frames, joints: np.ndarray) -> np.ndarray:
        pose = self.states[0].body_q.numpy()[bodies].astype(float)
        turn = Rotation.from_quat(pose[..., 3:].reshape(-1, 4))
        offset = turn.apply(frames.numpy()[joints][..., :3].reshape(-1, 3).astype(float))
        return pose[..., :3] + offset.reshape(pose[..., :3].shape)


def launched(chain: SpringChain, radius: float, places: np.ndarray) -> list[Shot]:
    """Launches from where the hand rests, `places` (N, 2) [m]; each leaves where it is fastest."""
    where = np.insert(places, 0, 0.0, axis=1)
    drawn = Cables([stage(chain, radius, place, held=True) for place in where], SETTLE)
    for _ in range(SETTLE_STEPS):
        drawn.advance()
    free = Cables([stage(chain, radius, place, held=False) for place in where], STEP)
    free.put(drawn)
    course = np.empty((STEPS, len(places), 6))
    for i in range(STEPS):
        free.advance()
        now = free.states[0]
        course[i, :, :3] = now.body_q.numpy()[free.pouches, :3]
        course[i, :, 3:] = now.body_qd.numpy()[free.pouches, :3]
    fastest = np.linalg.norm(course[..., 3:], axis=2).argmax(axis=0)
    shots = []
    for number, force in enumerate(np.linalg.norm(drawn.forces(), axis=1)):
        _, y, z, *velocity = course[fastest[number], number]
        landing = ballistic_landing(y, z, *velocity[1:], chain.floor)
        angle = np.arctan2(velocity[2], velocity[1])
        shots.append(Shot(float(landing), float(np.linalg.norm(velocity)), angle, float(force)))
    return shots


def block(content: dict) -> str:
    """What the page has between its marks: errors from the least to the greatest of all draws."""
    rows = ["| | force held | landing |", "|---|---:|---:|"]
    for name in VARIANTS:
        proof = [draw for band in content["bands"].values() for draw in band[name]["proof"]]
        errors = [[100 * draw[f"{of}_error"] for draw in proof] for of in ("hold_force", "landing")]
        cells = [f"{min(some):+.0f} to {max(some):+.0f} %".replace("-", "−") for some in errors]
        rows.append(row(name, *cells))
    return block_of("cables", rows)


def main() -> None:
    """Import, draw, launch, write. Raises UserError."""
    parser = argparse.ArgumentParser(prog="python -m validation.engines.newton_cable")
    parser.add_argument("bands", nargs="*", metavar="BAND")
    params, bands = load(), {}
    for band in parser.parse_args().bands or params.run.bands:
        model = Identification.of_run(band, params.run.methods[0])
        draws, rows = proof_draws(model), {}
        held = model.launches(draws).hold_force
        places = yielded(draws, held, params.setup.arm_stiffness)
        for name, chain in cables(model).items():
            proof = compared(model, draws, launched(chain, model.sling.radius, places))
            rows[name] = {
                "stretch_stiffness_n": chain.strength,
                "rest_length_m": chain.rest_length,
                "damping_time_s": chain.damping_time,
                "met": within_limits(proof),
                "proof": list(map(compared_row, proof)),
            }
            print(f"{band}, {name}: {'met' if rows[name]['met'] else 'NOT met'}", flush=True)
        bands[band] = rows
    content = {"asked": ASKED, "time_step_s": STEP, "iterations": ITERATIONS, "bands": bands}
    packages = ("newton", "newton-usd-schemas", "usd-core")
    versions = {name: version(name) for name in packages}
    fill(PAGE, block(write_report(REPORT, content, versions=versions, digits=6)))


STAGE = """#usda 1.0
(
    defaultPrim = "World"
    kilogramsPerUnit = 1
    metersPerUnit = 1
    upAxis = "Z"
)

def Xform "World"
{
    def PhysicsScene "PhysicsScene"
    {
        vector3f physics:gravityDirection = (0, 0, -1)
        float physics:gravityMagnitude = %(gravity)g
    }

    def Material "Rubber" (prepend apiSchemas = ["PhysicsMaterialAPI",
        "PhysicsCurvesDeformableMaterialAPI", "NewtonCurvesDeformableMaterialAPI"])
    {
        float physics:curvesBendStiffness = %(thread).9g
        float physics:curvesShearStiffness = %(stretch).9g
        float physics:curvesStretchStiffness = %(stretch).9g
        float physics:curvesTwistStiffness = %(thread).9g
        float newton:curvesShearDamping = %(damping).9g
        float newton:curvesStretchDamping = %(damping).9g
    }

    def BasisCurves "Band" (prepend apiSchemas = ["PhysicsDeformableBodyAPI",
        "PhysicsCurvesDeformableSimAPI", "MaterialBindingAPI"])
    {
        uniform token type = "linear"
        uniform token wrap = "nonperiodic"
        int[] curveVertexCounts = [%(count)d]
        point3f[] points = %(points)s
        point3f[] physics:restShapePoints = %(rest)s
        float physics:mass = %(mass).9g
        float[] physics:thicknesses = [%(thickness).9g]
        token physics:thicknesses:elementType = "constant"
        rel material:binding:physics = </World/Rubber>
    }

    def Xform "Pouch" (prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI"])
    {
        bool physics:kinematicEnabled = %(held)d
        float physics:mass = %(projectile).9g
        float3 physics:diagonalInertia = (1e-5, 1e-5, 1e-5)
        double3 xformOp:translate = %(place)s
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }

    def PhysicsAttachment "Clamps"
    {
        rel physics:src0 = </World/Band>
        rel physics:src1 = </World>
        token physics:type0 = "point"
        token physics:type1 = "xform"
        int[] physics:indices0 = [0, %(last)d]
        vector3f[] physics:coords1 = %(tips)s
    }

    def PhysicsAttachment "Hold"
    {
        rel physics:src0 = </World/Band>
        rel physics:src1 = </World/Pouch>
        token physics:type0 = "point"
        token physics:type1 = "xform"
        int[] physics:indices0 = [%(middle)d]
    }
}
"""


if __name__ == "__main__":
    errors.run(main)
