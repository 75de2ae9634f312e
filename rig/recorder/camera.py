"""The RGB-D camera: rays through a pinhole, shading without shadows, flaws of time of flight.

Depth is registered to colour: both share one optical frame (x right, y down, z ahead).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial.transform import Rotation

from rig.physics.scene import Mesh
from rig.recorder.sensors import direction

if TYPE_CHECKING:
    from pipeline.params.virtual_rig import RigCamera

WIDTH, HEIGHT = 640, 480
RATE = 30.0  # Hz
LIGHT = np.array([0.45, 0.35, 0.82]) / np.linalg.norm([0.45, 0.35, 0.82])
AMBIENT = 0.45
NEAR = 0.05  # m
EDGE = 0.03  # m between neighbours, from which on pixels are unsure


@dataclass(frozen=True)
class Exposure:
    """RGB from 0 to 1 (H, W, 3), and depth along the optical axis (H, W) [m], inf for nothing.

    Where something moved during the exposure, `depth` is what was seen for longest, `nearest` and
    `furthest` (H, W) the extremes.
    """

    color: np.ndarray
    depth: np.ndarray
    nearest: np.ndarray
    furthest: np.ndarray


@dataclass(frozen=True)
class VirtualCamera:
    """A pinhole camera in frame O.

    Attributes:
        position: Of its centre, shape (3,).
        rotation: Its optical frame into frame O.
        focal: Focal length [pixels].
        size: Width and height [pixels].
    """

    position: np.ndarray
    rotation: Rotation
    focal: float
    size: tuple[int, int] = (WIDTH, HEIGHT)

    @classmethod
    def looking(
        cls, position: np.ndarray, target: np.ndarray, focal: float, scale: float = 1.0
    ) -> VirtualCamera:
        """A level camera that looks at `target`; `scale` shrinks its pictures."""
        ahead = (target - position) / np.linalg.norm(target - position)
        right = np.cross(ahead, [0.0, 0.0, 1.0])
        right /= np.linalg.norm(right)
        axes = np.stack([right, np.cross(ahead, right), ahead], axis=1)
        size = (round(WIDTH * scale), round(HEIGHT * scale))
        return cls(position, Rotation.from_matrix(axes), focal * scale, size)

    def misplaced(self, settings: RigCamera, rng: np.random.Generator) -> VirtualCamera:
        """Where a calibration with small errors believes the camera to be."""
        return VirtualCamera(
            self.position + settings.translation_error * direction(rng),
            self.rotation * Rotation.from_rotvec(settings.rotation_error * direction(rng)),
            self.focal,
            self.size,
        )

    @property
    def center(self) -> tuple[float, float]:
        """Principal point; pixel (0, 0) has its middle at (0, 0)."""
        return (self.size[0] - 1) / 2, (self.size[1] - 1) / 2

    @cached_property
    def rays(self) -> np.ndarray:
        """Origin and direction with unit depth of every pixel's ray, (H, W, 6), float32."""
        column, row = np.meshgrid(np.arange(self.size[0]), np.arange(self.size[1]))
        cx, cy = self.center
        local = np.stack([(column - cx) / self.focal, (row - cy) / self.focal, 1 + 0 * row], -1)
        directions = self.rotation.apply(local.reshape(-1, 3)).reshape(local.shape)
        origins = np.broadcast_to(self.position, local.shape)
        return np.concatenate([origins, directions], axis=-1).astype(np.float32)

    def see(self, mesh: Mesh) -> Exposure:
        """The mesh alone before nothing."""
        import open3d as o3d

        scene = o3d.t.geometry.RaycastingScene()
        corners, triangles = mesh.vertices.astype(np.float32), mesh.triangles.astype(np.uint32)
        scene.add_triangles(corners, triangles)  # pyright: ignore[reportArgumentType]
        window = self.window(mesh.vertices)
        rays = np.ascontiguousarray(self.rays[window])
        hits = scene.cast_rays(o3d.core.Tensor(rays))  # pyright: ignore[reportCallIssue]
        reached = hits["t_hit"].numpy()
        seen = np.isfinite(reached)
        normals = hits["primitive_normals"].numpy()[seen]
        facing = -np.sign(np.sum(normals * rays[seen, 3:], axis=-1))
        bright = np.maximum(facing * (normals @ LIGHT.astype(np.float32)), 0)
        albedo = mesh.colors.astype(np.float32)[hits["primitive_ids"].numpy()[seen]]
        depth = np.full(self.size[::-1], np.inf, np.float32)
        color = np.zeros((*depth.shape, 3), np.float32)
        depth[window] = reached
        color[window][seen] = albedo * (AMBIENT + (1 - AMBIENT) * bright)[:, None]
        return Exposure(color, depth, depth, depth)

    def window(self, points: np.ndarray) -> tuple[slice, slice]:
        """Rows and columns that can see what lies between points (V, 3); all if some are behind."""
        local = self.rotation.apply(points - self.position, inverse=True)
        if local[:, 2].min() < NEAR:
            return slice(None), slice(None)
        pixels = self.focal * local[:, :2] / local[:, 2:] + self.center
        low, high = np.floor(pixels.min(axis=0)), np.ceil(pixels.max(axis=0)) + 1
        (left, top), (right, bottom) = np.clip([low, high], 0, self.size).astype(int)
        return slice(top, bottom), slice(left, right)


def nearer(first: Exposure, second: Exposure) -> Exposure:
    """Merge two pictures of one camera: at each pixel, what is nearer."""
    hidden = second.depth < first.depth
    depth = np.where(hidden, second.depth, first.depth)
    color = np.where(hidden[..., None], second.color, first.color)
    return Exposure(color, depth, depth, depth)


def blurred(instants: list[Exposure]) -> Exposure:
    """Pictures of equally long parts of one exposure as one."""
    if len(instants) == 1:
        return instants[0]
    depths = np.stack([instant.depth for instant in instants])
    return Exposure(
        np.mean([instant.color for instant in instants], axis=0),
        np.sort(depths, axis=0)[len(depths) // 2],
        depths.min(axis=0),
        depths.max(axis=0),
    )


def exposed(color: np.ndarray, settings: RigCamera, rng: np.random.Generator) -> np.ndarray:
    """8-bit RGB with noise, shape (H, W, 3)."""
    noise = settings.color_noise * rng.standard_normal(color.shape, np.float32)
    return np.clip(255 * color + noise, 0, 255).astype(np.uint8)


def measured_depth(picture: Exposure, settings: RigCamera, rng: np.random.Generator) -> np.ndarray:
    """Millimetres as a time-of-flight camera gives them, 0: none; uint16 (H, W).

    Noise grows with the square of the distance; where two surfaces share a pixel, at an edge or
    because one moves through it, some pixels are lost and some fly between the two.
    """
    depth, near, far = (
        np.where(distance < settings.range, distance, 0).astype(np.float32)
        for distance in (picture.depth, picture.nearest, picture.furthest)
    )
    near = np.stack([near, np.roll(near, 1, axis=0), np.roll(near, 1, axis=1)]).min(axis=0)
    far = np.stack([far, np.roll(far, 1, axis=0), np.roll(far, 1, axis=1)]).max(axis=0)
    chance = rng.random(depth.shape, np.float32)
    mixing = rng.random(depth.shape, np.float32)
    noisy = depth + settings.depth_noise * depth**2 * rng.standard_normal(depth.shape, np.float32)
    edge = (far - near > EDGE) & (near > 0)
    lost = edge & (chance < settings.edge_loss)
    flies = edge & ~lost & (chance < settings.edge_loss + settings.edge_fly)
    noisy = np.where(flies, near + mixing * (far - near), noisy)
    lost |= (chance > 1 - settings.dropout) | (depth == 0)
    return np.where(lost, 0, np.round(1000 * noisy)).astype(np.uint16)
