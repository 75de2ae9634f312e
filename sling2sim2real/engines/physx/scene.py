"""What worker.py reads: bands as deformable volumes in USD's text form, and how they are led.

The stage is by the schemas of PhysX and Omni Physics.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sling2sim2real.exporting.mesh import Tube
from sling2sim2real.exporting.usd import ITERATIONS, RATE, surface
from sling2sim2real.simulator.model import GRAVITY

SPACING = np.array([1.0, 2.5])  # m along x and y from band to band: none reaches the next
COLUMNS = 32
HEADER = """#usda 1.0
(
    defaultPrim = "World"
    metersPerUnit = 1
    upAxis = "Z"
)

def Xform "World"
{
    def PhysicsScene "PhysicsScene" (prepend apiSchemas = ["PhysxSceneAPI"])
    {
        vector3f physics:gravityDirection = (0, 0, -1)
        float physics:gravityMagnitude = %(gravity)g
        bool physxScene:enableGPUDynamics = 1
        token physxScene:broadphaseType = "GPU"
        token physxScene:solverType = "TGS"
        uint physxScene:timeStepsPerSecond = %(rate)d
    }
"""
BAND = """
    def Material "M%(name)s" (prepend apiSchemas = ["PhysicsMaterialAPI",
        "OmniPhysicsDeformableMaterialAPI", "PhysxDeformableMaterialAPI"])
    {
        float omniphysics:dynamicFriction = %(friction)g
        float omniphysics:poissonsRatio = %(poisson).9g
        float omniphysics:youngsModulus = %(young).9g
        float physxDeformableMaterial:elasticityDamping = %(damping).9g
    }

    def TetMesh "B%(name)s" (prepend apiSchemas = ["OmniPhysicsDeformableBodyAPI",
        "OmniPhysicsVolumeDeformableSimAPI", "OmniPhysicsDeformablePoseAPI:default",
        "PhysicsCollisionAPI", "MaterialBindingAPI", "PhysxBaseDeformableBodyAPI"])
    {
        bool omniphysics:deformableBodyEnabled = 1
        float omniphysics:mass = %(mass).9g
        uint physxDeformableBody:solverPositionIterationCount = %(iterations)d
        float physxDeformableBody:settlingDamping = 0
        float physxDeformableBody:sleepThreshold = 0
        point3f[] deformablePose:default:omniphysics:points = %(points)s
        uniform token[] deformablePose:default:omniphysics:purposes = ["bindPose"]
        point3f[] omniphysics:restShapePoints = %(points)s
        int4[] omniphysics:restTetVtxIndices = %(tetrahedra)s
        rel material:binding:physics = </World/M%(name)s> (
            bindMaterialAs = "weakerThanDescendants"
        )
        point3f[] points = %(points)s
        int3[] surfaceFaceVertexIndices = %(faces)s
        int4[] tetVertexIndices = %(tetrahedra)s
        float3 xformOp:translate = (%(x)g, %(y)g, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
"""


@dataclass(frozen=True)
class Drive:
    """A phase in which some nodes are led along a path; the others are free.

    Attributes:
        vertices: Those that are led, shape (D,).
        targets: Where they are at the end of each step [m], shape (S, D, 3) in every band, or
            (S, N, D, 3), one for each; with (1, ...) for all steps.
        fade: How much of their distance from targets[0] at the phase's begin is left, shape (S,).
        keep: Whether the nodes' places after each step are wanted.
    """

    vertices: np.ndarray
    targets: np.ndarray
    fade: np.ndarray
    keep: bool = False


def job(tube: Tube, start: np.ndarray, phases: list[Drive]) -> dict:
    """What is done with the N bands of a stage, whose nodes begin at `start` (N, nodes, 3) [m]."""
    content = {
        "step": 1 / RATE,
        "phases": len(phases),
        "offsets": offsets(len(start)),
        "rest": tube.rest.reshape(-1, 3),
        "start": start,
    }
    for i, phase in enumerate(phases):
        content |= {f"{name}_{i}": value for name, value in vars(phase).items()}
    return content


def offsets(count: int) -> np.ndarray:
    """Where each band's origin stands [m], shape (count, 3)."""
    row, column = np.divmod(np.arange(count), COLUMNS)
    return np.stack([column * SPACING[0], row * SPACING[1], 0.0 * row], axis=1)


def text(tube: Tube, thetas: np.ndarray) -> str:
    """The scene.

    Args:
        thetas: The five parameters of each band, shape (N, 5); the damping scale has no slot.
    """
    mesh = {
        "points": _tuples(tube.rest.reshape(-1, 3), ".9g"),
        "tetrahedra": _tuples(tube.tetrahedra, "d"),
        "faces": _tuples(surface(tube.tetrahedra), "d"),
        "mass": tube.mass.sum(),
        "iterations": ITERATIONS,
    }
    parts = [HEADER % {"gravity": GRAVITY, "rate": RATE}]
    for i, ((young, poisson, damping, friction, _), (x, y, _)) in enumerate(
        zip(thetas, offsets(len(thetas)), strict=True)
    ):
        names = {"young": young, "poisson": poisson, "damping": damping, "friction": friction}
        parts.append(BAND % {**mesh, **names, "name": f"{i:05d}", "x": x, "y": y})
    return "".join(parts) + "}\n"


def _tuples(rows: np.ndarray, form: str) -> str:
    """Rows as USD's text form has them."""
    return "[" + ", ".join(f"({', '.join(format(v, form) for v in row)})" for row in rows) + "]"
