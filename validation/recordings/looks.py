"""Pictures with known truth of a band before a fork, an arm, a floor and a wall, in many looks.

Triangles and rays (Open3D), a light that casts shadows, the noise, flying pixels and drop-outs of a
time-of-flight camera, JPEG. The band moves by the formulas of `bag`. Nothing of rig: what is tested
here did not learn from it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from types import SimpleNamespace

import cv2
import numpy as np
import open3d as o3d
from scipy.spatial.transform import Rotation

from sling2sim2real.recording.camera import Camera
from sling2sim2real.recording.frames import Geometry
from sling2sim2real.recording.messages import Picture
from sling2sim2real.recording.scene import Scene, View
from sling2sim2real.recording.streams import Recording, Stream
from sling2sim2real.recording.transforms import Transform
from validation.recordings.bag import FLOOR, REST, TIPS, Truth

TRUTH = Truth(release=2.9)

SIZE, FOCAL = (640, 480), 495.0
RANGE, BLUR = 2.2, 0.0006  # m beyond which there is no depth; noise at 1 m [m]
LIGHT = np.array([0.35, 0.30, 0.89])
COLOR_SCALE = 1.25
PARTS = ("floor", "tile", "wall", "fork", "base", "arm", "finger", "band")
FLOOR_ID, TILE, WALL, FORK, BASE, ARM, FINGER, BAND = range(len(PARTS))
PITCH = 0.2  # of the hand, below the horizon [rad]
APPROACH = np.array([0.0, np.cos(PITCH), -np.sin(PITCH)])
AXES = np.stack([[1.0, 0, 0], np.cross(APPROACH, [1.0, 0, 0]), APPROACH], axis=1)


@dataclass(frozen=True)
class Appearance:
    """Colours (BGR), light and shape of what is seen.

    Attributes:
        band, arm, finger, fork, floor, wall: Colours.
        light: Share of the light that comes from one side; the rest is everywhere.
        diameter: Of the band [m].
        eye: Where the camera stands, frame O.
        offset: Of the colour camera in the depth camera's frame [m]; None: registered depth.
            Such a colour camera has COLOR_SCALE as many pixels a side.
    """

    band: tuple[int, int, int] = (30, 120, 235)
    arm: tuple[int, int, int] = (228, 230, 230)
    finger: tuple[int, int, int] = (75, 75, 75)
    fork: tuple[int, int, int] = (165, 160, 158)
    floor: tuple[int, int, int] = (92, 100, 107)
    wall: tuple[int, int, int] = (145, 153, 148)
    light: float = 0.55
    diameter: float = 0.010
    eye: tuple[float, float, float] = (0.80, 0.32, 0.50)
    offset: tuple[float, float, float] | None = None


WHITE = {"band": (222, 226, 228), "finger": (220, 222, 222)}
LOOKS = {
    "orange on grey, white arm": Appearance(),
    "near white beside a white arm": Appearance(**WHITE),
    "dark in shadow, dark floor and arm": Appearance(
        band=(38, 36, 34),
        floor=(45, 47, 50),
        wall=(60, 60, 60),
        arm=(52, 50, 50),
        finger=(40, 40, 40),
        fork=(60, 58, 58),
        light=0.8,
    ),
    "the floor's colour": Appearance(band=(92, 100, 107)),
    "the wall's and the fork's colour": Appearance(
        band=(150, 155, 152), fork=(150, 155, 152), wall=(150, 155, 152), arm=(160, 160, 160)
    ),
    "4 mm thin": Appearance(diameter=0.004),
    "4 mm thin, white, white arm": Appearance(diameter=0.004, **WHITE),
    "blue, blue glove": Appearance(
        band=(150, 80, 35), finger=(150, 82, 38), arm=(145, 85, 40), floor=(160, 165, 168)
    ),
    "white, from the other side": Appearance(eye=(-0.55, 0.62, 0.30), **WHITE),
    "orange, colour camera apart": Appearance(offset=(0.06, 0.01, 0.0)),
    "white, from behind and above": Appearance(eye=(0.62, -0.75, 0.55), **WHITE),
}


@dataclass
class FrameTruth:
    """Truth of one picture: what each pixel shows, and the band's middle and radius."""

    line: np.ndarray  # (N, 3) frame O
    radius: np.ndarray  # (N,)
    part: np.ndarray  # (H, W)
    depth: np.ndarray  # (H, W) m, without noise


def optical(eye: np.ndarray) -> Rotation:
    """A level camera's frame in frame O: x right, y down, z towards the fork and the pull."""
    ahead = np.array([0.0, -0.12, -0.14]) - eye
    ahead /= np.linalg.norm(ahead)
    right = np.cross(ahead, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    return Rotation.from_matrix(np.stack([right, np.cross(ahead, right), ahead], axis=1))


def camera(frame: str = "depth", scale: float = 1.0) -> Camera:
    width, height = (round(scale * size) for size in SIZE)
    focal = scale * FOCAL
    matrix = np.array([[focal, 0, (width - 1) / 2], [0, focal, (height - 1) / 2], [0, 0, 1]])
    return Camera(width, height, matrix, np.zeros(0), frame)


def _box(size, center, axes=None) -> o3d.geometry.TriangleMesh:
    mesh = o3d.geometry.TriangleMesh.create_box(*size)
    mesh.translate(-np.array(size) / 2)
    return mesh.rotate(np.eye(3) if axes is None else axes, np.zeros(3)).translate(center)


def _rod(start, end, radius) -> list[o3d.geometry.TriangleMesh]:
    """A cylinder with round ends."""
    way = np.asarray(end) - start
    size = np.linalg.norm(way)
    turn, _ = Rotation.align_vectors([way / size], [[0.0, 0.0, 1.0]])
    rod = o3d.geometry.TriangleMesh.create_cylinder(radius, size, 24)
    rod.rotate(turn.as_matrix(), np.zeros(3)).translate((np.asarray(start) + end) / 2)
    balls = [o3d.geometry.TriangleMesh.create_sphere(radius, 16).translate(p) for p in (start, end)]
    return [rod, *balls]


def _still() -> list[tuple[int, o3d.geometry.TriangleMesh]]:
    parts = [(FLOOR_ID, _box((8, 8, 0.02), (0, 0, FLOOR - 0.01)))]
    tiles = [(i, j) for i in range(-4, 4) for j in range(-5, 5) if (i + j) % 2]
    parts += [(TILE, _box((0.4, 0.4, 0.001), (0.4 * i, 0.4 * j, FLOOR))) for i, j in tiles]
    parts += [(WALL, _box((0.02, 8, 3), (x, 0, 0.98))) for x in (-1.6, 1.9)]
    parts += [(WALL, _box((8, 0.02, 3), (0, 2.2, 0.98)))]
    for tip in TIPS:
        side = np.sign(tip[0])
        post = tip[0] + side * 0.025
        parts.append((FORK, _box((0.02, 0.02, 0.535), (post, 0, FLOOR + 0.2675))))
        parts.append((FORK, _box((0.03, 0.02, 0.02), tip + [side * 0.015, 0, 0.011])))
    parts.append((FORK, _box((0.5, 0.06, 0.02), (0, 0, FLOOR + 0.01))))
    parts.append((BASE, _box((0.4, 0.4, 0.1), (0, -0.95, FLOOR + 0.05))))
    return parts


def _arm(time: float) -> list[tuple[int, o3d.geometry.TriangleMesh]]:
    tip, fingers = TRUTH.hand(time), opening(time) / 2 + 0.006
    parts = [(ARM, _box((0.07, 0.2, 0.07), tip - 0.10 * APPROACH, AXES))]
    for sign in (-1, 1):
        aside = sign * fingers * AXES[:, 1]
        parts.append((FINGER, _box((0.02, 0.012, 0.07), tip - 0.025 * APPROACH + aside, AXES)))
    wrist, shoulder = tip - 0.26 * APPROACH, np.array([0.0, -0.95, -0.1])
    for start, end, radius in (
        (tip - 0.13 * APPROACH, wrist, 0.045),
        (wrist, shoulder, 0.055),
        (shoulder, np.array([0.0, -0.95, FLOOR]), 0.08),
    ):
        parts += [(ARM, mesh) for mesh in _rod(start, end, radius)]
    return parts


def opening(time: float) -> float:
    """Between the fingers [m]."""
    moves = [TRUTH.grasp - 0.1, TRUTH.grasp, TRUTH.release, TRUTH.release + 0.05]
    return float(np.interp(time, moves, [0.07, 0.01, 0.01, 0.07]))


def _tube(line: np.ndarray, radius: np.ndarray) -> o3d.geometry.TriangleMesh:
    """About a line (N, 3), 16 sides; a frame that is carried along without twist."""
    sides = 16
    tangents = np.gradient(line, axis=0)
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    normal, rings = np.cross(tangents[0], [0.0, 1.0, 0.1]), []
    angle = 2 * np.pi * np.arange(sides)[:, None] / sides
    for point, tangent, thick in zip(line, tangents, radius, strict=True):
        normal = normal - (normal @ tangent) * tangent
        normal /= np.linalg.norm(normal)
        ring = np.cos(angle) * normal + np.sin(angle) * np.cross(tangent, normal)
        rings.append(point + thick * ring)
    node, side = np.meshgrid(np.arange(len(line) - 1), np.arange(sides), indexing="ij")
    a, b = node * sides + side, node * sides + (side + 1) % sides
    c, d = a + sides, b + sides
    faces = np.concatenate([np.stack(f, -1).reshape(-1, 3) for f in ((a, c, b), (b, c, d))])
    return o3d.geometry.TriangleMesh(
        o3d.utility.Vector3dVector(np.concatenate(rings)), o3d.utility.Vector3iVector(faces)
    )


def band(time: float, diameter: float) -> tuple[np.ndarray, np.ndarray]:
    """Centre line (N, 3) and radius (N,), thinner where it is stretched."""
    first, second = np.split(TRUTH.center_line(time), 2)
    line = np.concatenate([first, second[-2::-1]])
    stretch = np.linalg.norm(np.diff(line, axis=0), axis=1) * (len(line) - 1) / REST
    middles = np.arange(len(line) - 1) + 0.5
    stretch = np.clip(np.interp(np.arange(len(line)), middles, stretch), 0.8, 4)
    return line, diameter / 2 / np.sqrt(stretch)


@lru_cache(maxsize=120)
def _seen(time: float, diameter: float, eye: tuple, from_: tuple | None = None):
    """What a camera sees: part, brightness without and with the lamp, depth; each (H, W)."""
    line, radius = band(time, diameter)
    scene, owner = o3d.t.geometry.RaycastingScene(), []
    for part, mesh in [*_still(), *_arm(time), (BAND, _tube(line, radius))]:
        scene.add_triangles(o3d.t.geometry.TriangleMesh.from_legacy(mesh))
        owner.append(part)
    turn, place, looks = optical(np.array(eye)), np.array(eye), camera()
    if from_ is not None:
        place, looks = place + turn.apply(from_), camera("color", COLOR_SCALE)
    ways = turn.apply(looks.rays().reshape(-1, 3)).reshape(looks.height, looks.width, 3)
    rays = np.concatenate([np.broadcast_to(place, ways.shape), ways], axis=-1).astype(np.float32)
    hits = scene.cast_rays(o3d.core.Tensor(rays))
    depth = hits["t_hit"].numpy()
    sees = np.isfinite(depth)
    part = np.array([*owner, WALL])[np.where(sees, hits["geometry_ids"].numpy(), len(owner))]
    normals = hits["primitive_normals"].numpy()
    normals = normals * -np.sign(np.sum(normals * ways, axis=-1, keepdims=True))
    facing = np.maximum(normals @ LIGHT, 0)
    start = place + ways * np.where(sees, depth, 1)[..., None] + 1e-3 * normals
    lamp = np.broadcast_to(LIGHT, ways.shape)
    dark = scene.test_occlusions(
        o3d.core.Tensor(np.concatenate([start, lamp], axis=-1).astype(np.float32))
    ).numpy()
    bright = np.where(dark, 0, facing).astype(np.float32)
    return part.astype(np.uint8), bright, depth.astype(np.float32)


def _jpeg(look: Appearance, part: np.ndarray, bright: np.ndarray, random) -> Picture:
    tile = tuple(0.8 * np.array(look.floor))
    base = (52, 50, 50)
    colors = (look.floor, tile, look.wall, look.fork, base, look.arm, look.finger, look.band)
    shade = (1 - look.light) + look.light * bright
    color = np.array(colors, np.float32)[part] * shade[..., None]
    color += random.normal(0, 1.5, color.shape)
    _, packed = cv2.imencode(".jpg", np.clip(color, 0, 255).astype(np.uint8))
    return Picture("", "jpeg", packed.ravel())


def _millimetres(depth: np.ndarray, random) -> Picture:
    """Picture of depths as a time-of-flight camera gives them, in millimetres, 0 for none."""
    depth = np.where(depth < RANGE, depth, 0).astype(np.float32)
    near = cv2.erode(np.where(depth > 0, depth, 9).astype(np.float32), np.ones((2, 2)))
    far = cv2.dilate(depth, np.ones((2, 2)))
    chance, share = random.random((2, *depth.shape), np.float32)
    noisy = depth + BLUR * depth**2 * random.standard_normal(depth.shape, np.float32)
    edge = (depth > 0) & (far - near > 0.03)
    lost = (depth == 0) | (chance < 0.003) | (edge & (chance < 0.35))
    flies = edge & (chance > 0.85)
    noisy = np.where(flies, near + share * (far - near), noisy)
    data = np.where(lost, 0, np.round(1000 * noisy)).astype("<u2").view(np.uint8).ravel()
    return Picture("16UC1", "", data, *depth.shape, 2 * depth.shape[1])


def times(count: int) -> np.ndarray:
    """Stamps of so many frames with a pace that is finer after the release."""
    before = np.linspace(0.05, TRUTH.release - 0.03, count - 2 * count // 5)
    after = TRUTH.release + 0.004 + 1.25 * np.linspace(0, 1, 2 * count // 5) ** 1.5
    return np.concatenate([before, after])


def view_of(look: Appearance, stamps: np.ndarray, seed: int = 0) -> tuple[View, list[FrameTruth]]:
    """A view of a recording in this look, and what is true of each frame."""
    random = np.random.default_rng(seed)
    colors, depths, truths = [], [], []
    for time in map(float, stamps):
        part, bright, depth = _seen(time, look.diameter, look.eye)
        truths.append(FrameTruth(*band(time, look.diameter), part, depth))
        if look.offset is not None:
            part, bright, _ = _seen(time, look.diameter, look.eye, look.offset)
        colors.append(_jpeg(look, part, bright, random))
        depths.append(_millimetres(truths[-1].depth, random))
    return assemble(look, stamps, colors, depths), truths


def assemble(look: Appearance, stamps: np.ndarray, colors: list, depths: list) -> View:
    """A view of these pictures, as if they had been read of a recording."""
    nanoseconds = np.round(stamps * 1e9).astype(np.int64)
    colors = [
        replace(picture, stamp=int(t)) for picture, t in zip(colors, nanoseconds, strict=True)
    ]
    apart = look.offset is not None
    recording = Recording(
        path=Path("look.mcap"),
        **dict.fromkeys(("wrench", "pose", "gripper", "transforms")),
        depth=Stream("/depth", "depth", nanoseconds, depths, 0.0, 0),
        color=Stream("/color", "color" if apart else "depth", nanoseconds, colors, 0.0, 0),
        depth_camera=camera(),
        color_camera=camera("color", COLOR_SCALE) if apart else camera(),
    )
    # The extrinsics are known with small errors.
    turn = optical(np.array(look.eye)) * Rotation.from_rotvec(0.0015 * np.array([0.6, -0.5, 0.62]))
    place = np.array(look.eye) + 0.001 * np.array([0.5, 0.7, -0.5])
    to_color = Transform(Rotation.identity(), -np.array(look.offset or (0, 0, 0), float))
    geometry = Geometry(
        Transform.identity(), Transform(turn, place), to_color, Rotation.identity(), True, {}
    )
    signals = SimpleNamespace(  # what the pipeline knows of the hand: recording.signals.Signals
        time=np.linspace(0, TRUTH.end, 140),
        origin=0,
        grasp_time=TRUTH.grasp,
        release_time=TRUTH.release,
        tool_axis=APPROACH,
        facts=SimpleNamespace(turn=0.0),
        hand=TRUTH.hand,
        opening_at=opening,
    )
    scene = Scene(TIPS, FLOOR, look.diameter, REST, signals)
    return View(recording, geometry, scene, TRUTH.end)


PHASES = ("hanging", "lift", "taut", "recoil", "swing")


def phase(time: float) -> str:
    if time < TRUTH.grasp:
        return "hanging"
    if time < TRUTH.release:
        far = np.linalg.norm(TIPS - TRUTH.hand(time), axis=1).sum()
        return "taut" if far > 1.05 * REST else "lift"
    return "recoil" if time < TRUTH.release + 0.1 else "swing"


def score(
    view: View, frame: object, truth: FrameTruth, points: np.ndarray
) -> dict[str, np.ndarray]:
    """How a cloud compares with the truth.

    Returns:
        off: Distances of the points from the band's surface [m]; covered: for each 5 mm of the
        band that has pixels with depth, whether points lie within 5 mm of its surface.
    """
    nodes = np.arange(len(truth.line))
    arc = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(truth.line, axis=0), axis=1))])
    fine = np.interp(np.arange(0, arc[-1], 0.0025), arc, nodes)
    line = np.stack([np.interp(fine, nodes, axis) for axis in truth.line.T], axis=1)
    radius = np.interp(fine, nodes, truth.radius)
    part, depth = truth.part[view.window], truth.depth[view.window]
    bears = (part == BAND) & (np.abs(frame.depth - depth) < 0.005)
    away = np.linalg.norm(frame.points[bears][:, None] - line[None], axis=-1)
    seen = np.unique(away.argmin(axis=1) // 2) if len(away) else np.zeros(0, int)
    gaps = np.linalg.norm(points[:, None].astype(float) - line[None], axis=-1) - radius
    if not len(points):
        return {"off": np.zeros(0), "covered": np.zeros(len(seen), bool)}
    reached = gaps.min(axis=0) < 0.005
    bins = np.add.reduceat(reached, np.arange(0, len(line), 2)) > 0
    return {"off": np.abs(gaps.min(axis=1)), "covered": bins[seen]}


def figures(view: View, truths: list[FrameTruth], clouds: object) -> dict[str, dict[str, float]]:
    """Score all frames and each phase: median distance from the surface, covered share, strays."""
    scores: dict[str, list] = {"all": []}
    for (number, frame), points in zip(view.frames(), clouds.points, strict=True):
        one = score(view, frame, truths[number], points)
        scores["all"].append(one)
        scores.setdefault(phase(frame.time), []).append(one)
    summary = {}
    for name, some in scores.items():
        off, covered = (np.concatenate([one[key] for one in some]) for key in ("off", "covered"))
        summary[name] = {
            "frames": len(some),
            "median_off_m": float(np.median(off)),
            "covered": float(np.mean(covered)),
            "further_than_1cm": float(np.mean(off > 0.01)),
        }
    return summary
