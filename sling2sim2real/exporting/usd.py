"""The band as a deformable volume in USD's text form, by the schemas of PhysX and Omni Physics.

PhysX's law (softBodyGM.cu of PhysX 5.6, the model eCO_ROTATIONAL) holds |F - R| = 0 and J = 1 in
each tetrahedron,

    P = 2 mu (F - R) + lam (J - 1) cof F

with Lame's mu and lam and the rotation R in F. It is stiffer than rubber when stretched, so that
Young's modulus is scaled until a straight string of it holds as the calibrated simulation does.
Where PhysX is at hand, modulus, mass, rest length and the clamps' height are then matched in it
(MATCH).

The stage opens with the straight band at rest: a volume whose `points` are bent while it is opened
collapses across in PhysX (reports/validation/export-usd-causes.json), and holds too little. So the
ends are nodes to be led, not attachments; nodes.json says which, and where.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sling2sim2real.api.model import Model
from sling2sim2real.base.files import write_json, write_text
from sling2sim2real.base.imported import imported
from sling2sim2real.exporting.card import ASKED, FRAMES, compared_row, identified, readme
from sling2sim2real.exporting.chain import SpringChain
from sling2sim2real.exporting.match import DrawCompared, draws_of, within_limits
from sling2sim2real.exporting.mesh import Tube
from sling2sim2real.quantities import rounded
from sling2sim2real.simulator.launch import Launches
from sling2sim2real.simulator.model import GRAVITY

STEPS_PER_S, SOLVER_ITERATIONS = 200, 64  # steps a second, of the solver: the paper's
EDGES, GRADING = 52, 1.0  # between the clamps: 18 tetrahedra each
TARGET_MARGIN = 1.2  # times nearer and farther than policy.targets: landings that are matched
# What stages that are matched on paper alone leave in PhysX, least and most over three virtual
# bands and three draws each: reports/validation/export-usd.json.
ON_PAPER = {"hold_force": (0.02, 0.16), "landing": (0.01, 0.21)}
MATCH = "sling2sim2real.engines.physx.match:matched"  # in PhysX; None where that is not there


@dataclass(frozen=True)
class UsdBand:
    """What a stage says of a band.

    Attributes:
        tube: Its mesh; `clamped` is where it hangs between the clamps.
        young, poisson, friction: Of its material [Pa, -, -]; it has no damping, by which PhysX's
            solver would hold otherwise.
    """

    tube: Tube
    young: float
    poisson: float
    friction: float

    @property
    def mass(self) -> float:
        """Mass, with what is in the clamps [kg]."""
        return float(self.tube.mass.sum())

    @property
    def rest_length(self) -> float:
        """Length at rest between the clamps [m]."""
        return float(np.ptp(self.tube.rest[1:-1, 0, 0]))

    @property
    def height(self) -> float:
        """Height of the clamps above the origin [m]."""
        return float(self.tube.clamped[[1, -2], 0, 2].mean())


@dataclass(frozen=True)
class UsdMatch:
    """A band as matched in PhysX.

    Attributes:
        match, proof: Its draws, and those that took no part.
        on_paper: Those of the proof by the band that is matched on paper alone.
        engine: Name and version.
    """

    band: UsdBand
    match: Sequence[DrawCompared]
    proof: Sequence[DrawCompared]
    on_paper: Sequence[DrawCompared]
    engine: str

    @property
    def met(self) -> bool:
        return within_limits(self.proof)


def to_usd(model: Model, folder: Path, _: int) -> dict:
    """<band>.usda, nodes.json, and README.md: what it is, and what it is not."""
    draws, ours = near_draws(model)
    tension, stretch = SpringChain.tension(model, draws, ours.hold_force)
    theta = model.parameters.sample()
    poisson = theta["poissons_ratio"]
    unit = np.pi * model.band.diameter**2 / 4 * nominal(stretch, poisson)
    tube = Tube.of(model.sling, EDGES, GRADING)
    on_paper = float(np.sum(tension / unit) / len(draws))
    band = start = UsdBand(tube, on_paper, poisson, theta["dynamic_friction"])
    done: UsdMatch | None = imported(MATCH)(model, band)
    if done:
        band = done.band
    name = f"{model.band.name}.usda"
    write_text(folder / name, text(band))
    write_json(folder / "nodes.json", nodes(band))
    left = on_paper * unit / tension - 1
    files = {
        name: "the model",
        "nodes.json": "where it hangs, and which nodes clamps and hand lead",
        "README.md": "what it is, and what it is not",
    }
    content = identified(model, "usd", files) | {
        "replayed": done is not None,
        "matched": [
            {"name": "youngs_modulus", "value": rounded(band.young, 6), "unit": "Pa"},
            {"name": "mass", "value": rounded(band.mass, 6), "unit": "kg"},
            {"name": "rest_length", "value": rounded(band.rest_length, 6), "unit": "m"},
            {"name": "clamp_height", "value": rounded(band.height, 6), "unit": "m"},
        ],
        "factor_on_youngs_modulus": rounded(band.young / theta["youngs_modulus"], 4),
        "factor_on_mass": rounded(band.mass / start.mass, 4),
        "factor_on_rest_length": rounded(band.rest_length / start.rest_length, 4),
        "tension_errors": [rounded(float(error)) for error in left],
        "stretches": [rounded(float(value), 4) for value in stretch],
        "time_step_s": 1 / STEPS_PER_S,
        "iterations": SOLVER_ITERATIONS,
        "tetrahedra": len(tube.tetrahedra),
    }
    if done:
        content |= {
            "engine": done.engine,
            "asked": ASKED,
            "met": done.met,
            "proof": list(map(compared_row, done.proof)),
            "match": list(map(compared_row, done.match)),
            "on_paper": list(map(compared_row, done.on_paper)),
        }
    write_text(folder / "README.md", readme(content, expected=ON_PAPER))
    return content


def near_draws(model: Model) -> tuple[np.ndarray, Launches]:
    """What `draws_of` gives, near policy.targets alone; all where that is too few."""
    (draws, ours), (near, far) = draws_of(model), model.settings.policy.targets
    good = (ours.landing_y > near / TARGET_MARGIN) & (ours.landing_y < far * TARGET_MARGIN)
    return (draws[good], ours[good]) if good.sum() > 2 else (draws, ours)


def nodes(band: UsdBand) -> dict:
    """Numbers of the nodes that are led, and places (V, 3) [m] of the hanging band."""
    return {
        "frame": FRAMES,
        "ends": band.tube.ends.tolist(),
        "hand": band.tube.hand.tolist(),
        "hanging_m": np.round(band.tube.clamped.reshape(-1, 3), 9).tolist(),
    }


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


def text(band: UsdBand) -> str:
    """The exported stage: scene, material, the straight band."""
    values = {name: getattr(band, name) for name in ("young", "poisson", "friction")}
    named = {"material": "Rubber", "name": "Band", "place": ""}
    return stage(band.tube, [{**values, **named, "damping": 0.0}])


def stage(tube: Tube, bands: Iterable[Mapping[str, object]]) -> str:
    """A stage of equal straight bands: for each what BAND names and the mesh does not have."""
    rest = tube.rest
    mesh = {
        "iterations": SOLVER_ITERATIONS,
        "mass": tube.mass.sum(),
        "rest": _tuples(rest.reshape(-1, 3)),
        "tetrahedra": _tuples(tube.tetrahedra),
        "faces": _tuples(surface(tube.tetrahedra)),
        "extent": _tuples(np.stack([rest.min((0, 1)), rest.max((0, 1))])),
    }
    head = SCENE % {"gravity": GRAVITY, "rate": STEPS_PER_S}
    return head + "".join(BAND % {**mesh, **band} for band in bands) + "}\n"


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


SCENE = """#usda 1.0
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
"""
BAND = """
    def Material "%(material)s" (prepend apiSchemas = ["PhysicsMaterialAPI",
        "OmniPhysicsDeformableMaterialAPI", "PhysxDeformableMaterialAPI"])
    {
        float omniphysics:dynamicFriction = %(friction).9g
        float omniphysics:poissonsRatio = %(poisson).9g
        float omniphysics:youngsModulus = %(young).9g
        float physxDeformableMaterial:elasticityDamping = %(damping).9g
    }

    def TetMesh "%(name)s" (prepend apiSchemas = ["OmniPhysicsDeformableBodyAPI",
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
        rel material:binding:physics = </World/%(material)s> (
            bindMaterialAs = "weakerThanDescendants"
        )
        point3f[] points = %(rest)s
        int3[] surfaceFaceVertexIndices = %(faces)s
        int4[] tetVertexIndices = %(tetrahedra)s
%(place)s    }
"""
