"""The band as a deformable volume in USD's text form, by the schemas of PhysX and Omni Physics.

Nothing is simulated in PhysX here. Its law (softBodyGM.cu of PhysX 5.6, the model eCO_ROTATIONAL)
holds |F - R| = 0 and J = 1 in each tetrahedron,

    P = 2 mu (F - R) + lam (J - 1) cof F

with Lame's mu and lam and the rotation R in F. It is stiffer than rubber when stretched, so that
Young's modulus is scaled until a straight string of it holds as the calibrated simulation does.
"""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np

from pipeline.base.files import write_text
from pipeline.episode.episode import Episode
from pipeline.export import values as export_values
from pipeline.export.band import CalibratedBand
from pipeline.export.card import readme
from pipeline.export.chain import SpringChain
from pipeline.export.match import draws_of
from pipeline.export.mesh import Tube
from pipeline.report.quantities import rounded
from pipeline.simulator.model import GRAVITY

RATE, ITERATIONS = 200, 64  # steps a second, of the solver: the paper's
EDGES, GRADING = 52, 1.0  # between the clamps: 18 tetrahedra each


def to_usd(model: CalibratedBand, folder: Path, episode: Episode | None) -> dict:
    """<band>.usda, and README.md: what it is, and what it is not."""
    draws = draws_of(model)
    tension, stretch = SpringChain.tension(model, draws, model.launches(draws).hold_force)
    theta = model.parameters.sample()
    poisson = theta["poissons_ratio"]
    unit = np.pi * model.band.diameter**2 / 4 * nominal(stretch, poisson)
    young = float(np.sum(tension / unit) / len(draws))
    damping = theta["elasticity_damping"] * theta["damping_scale"]
    tube = Tube.of(model.sling, EDGES, GRADING)
    name = f"{model.band.name}.usda"
    write_text(folder / name, text(tube, young, poisson, damping, theta["dynamic_friction"]))
    left = young * unit / tension - 1
    content = {
        "band": model.band.name,
        "target": "usd",
        "files": {name: "the model", "README.md": "what it is, and what it is not"},
        "frames": export_values.FRAMES,
        "sizes": export_values.sizes(model),
        "law": model.parameters.law,
        "values": export_values.values(model),
        "replayed": False,
        "matched": [
            {"name": "youngs_modulus", "value": rounded(young, 6), "unit": "Pa"},
            {"name": "elasticity_damping", "value": rounded(damping, 6), "unit": "s"},
        ],
        "factor_on_youngs_modulus": rounded(young / theta["youngs_modulus"], 4),
        "tension_errors": [rounded(float(error)) for error in left],
        "stretches": [rounded(float(value), 4) for value in stretch],
        "time_step_s": 1 / RATE,
        "iterations": ITERATIONS,
        "tetrahedra": len(tube.tetrahedra),
    }
    write_text(folder / "README.md", readme(content))
    return content


def nominal(stretch: np.ndarray, poisson: float) -> np.ndarray:
    """Pull of a straight string over its section at rest and Young's modulus, free to contract.

    No stress across, 2 mu (q - 1) + lam (l q^2 - 1) l q = 0, gives the section's ratio q: the one
    root between 0 and 1 + 1/l, by Newton's method from above.
    """
    mu, lam = 1 / (2 * (1 + poisson)), poisson / ((1 + poisson) * (1 - 2 * poisson))
    length = np.asarray(stretch, float)
    across = 1 + 1 / length
    for _ in range(60):
        value = 2 * mu * (across - 1) + lam * (length * across**2 - 1) * length * across
        across = across - value / (2 * mu + lam * length * (3 * length * across**2 - 1))
    return 2 * mu * (length - 1) + lam * (length * across**2 - 1) * across**2


def text(tube: Tube, young: float, poisson: float, damping: float, friction: float) -> str:
    """The stage: scene, material, the hanging band, two clamps that hold its ends."""
    count = tube.rest.shape[1]
    last = len(tube.mass) - 2 * count
    tips = tube.clamped[[1, -2], 0]
    clamps = [
        CLAMP
        % {
            "side": side,
            "place": _tuples(tip[None])[1:-1],
            "vertices": list(range(first, first + 2 * count)),
            "offsets": _tuples(tube.clamped[part].reshape(-1, 3) - tip),
        }
        for side, tip, first, part in (
            ("Left", tips[0], 0, slice(0, 2)),
            ("Right", tips[1], last, slice(-2, None)),
        )
    ]
    return STAGE % {
        "gravity": GRAVITY,
        "rate": RATE,
        "iterations": ITERATIONS,
        "young": young,
        "poisson": poisson,
        "damping": damping,
        "friction": friction,
        "mass": tube.mass.sum(),
        "rest": _tuples(tube.rest.reshape(-1, 3)),
        "points": _tuples(tube.clamped.reshape(-1, 3)),
        "tetrahedra": _tuples(tube.tetrahedra),
        "faces": _tuples(surface(tube.tetrahedra)),
        "extent": _tuples(np.stack([tube.clamped.min((0, 1)), tube.clamped.max((0, 1))])),
        "clamps": "".join(clamps),
    }


def surface(tetrahedra: np.ndarray) -> np.ndarray:
    """Faces (F, 3) that belong to one tetrahedron only, seen counter-clockwise from outside."""
    faces = tetrahedra[:, [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]].reshape(-1, 3)
    keys = [tuple(face) for face in np.sort(faces, axis=1)]
    count = Counter(keys)
    return faces[[count[key] == 1 for key in keys]]


def _tuples(rows: np.ndarray) -> str:
    form = "d" if np.issubdtype(rows.dtype, np.integer) else ".9g"
    shown = rows if form == "d" else np.round(rows, 12) + 0.0
    return "[" + ", ".join(f"({', '.join(format(v, form) for v in row)})" for row in shown) + "]"


STAGE = """#usda 1.0
(
    defaultPrim = "World"
    kilogramsPerUnit = 1
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

    def Material "Rubber" (prepend apiSchemas = ["PhysicsMaterialAPI",
        "OmniPhysicsDeformableMaterialAPI", "PhysxDeformableMaterialAPI"])
    {
        float omniphysics:dynamicFriction = %(friction).9g
        float omniphysics:poissonsRatio = %(poisson).9g
        float omniphysics:youngsModulus = %(young).9g
        float physxDeformableMaterial:elasticityDamping = %(damping).9g
    }

    def TetMesh "Band" (prepend apiSchemas = ["OmniPhysicsDeformableBodyAPI",
        "OmniPhysicsVolumeDeformableSimAPI", "OmniPhysicsDeformablePoseAPI:default",
        "PhysicsCollisionAPI", "MaterialBindingAPI", "PhysxBaseDeformableBodyAPI"])
    {
        bool omniphysics:deformableBodyEnabled = 1
        float omniphysics:mass = %(mass).9g
        uint physxDeformableBody:solverPositionIterationCount = %(iterations)d
        float physxDeformableBody:settlingDamping = 0
        float physxDeformableBody:sleepThreshold = 0
        point3f[] deformablePose:default:omniphysics:points = %(rest)s
        uniform token[] deformablePose:default:omniphysics:purposes = ["bindPose"]
        float3[] extent = %(extent)s
        point3f[] omniphysics:restShapePoints = %(rest)s
        int4[] omniphysics:restTetVtxIndices = %(tetrahedra)s
        rel material:binding:physics = </World/Rubber> (
            bindMaterialAs = "weakerThanDescendants"
        )
        point3f[] points = %(points)s
        int3[] surfaceFaceVertexIndices = %(faces)s
        int4[] tetVertexIndices = %(tetrahedra)s
    }
%(clamps)s}
"""
CLAMP = """
    def Xform "Clamp%(side)s"
    {
        double3 xformOp:translate = %(place)s
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }

    def OmniPhysicsVtxXformAttachment "Hold%(side)s"
    {
        point3f[] omniphysics:localPositionsSrc1 = %(offsets)s
        rel omniphysics:src0 = </World/Band>
        rel omniphysics:src1 = </World/Clamp%(side)s>
        int[] omniphysics:vtxIndicesSrc0 = %(vertices)s
    }
"""
