"""A recording on one timeline for the Rerun viewer: pictures, cloud, hand, force, events.

Seconds count from the first force, as in the report. Space is frame O. https://rerun.io
"""

# Rerun is an extra.
# pyright: reportMissingImports=false
from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import cv2
import numpy as np

from sling2sim2real.base.errors import UserError
from sling2sim2real.base.files import replacing
from sling2sim2real.cli.preflight.check import Look
from sling2sim2real.cli.preflight.facts import SignalSummary
from sling2sim2real.cli.preflight.sheet import masked_frames
from sling2sim2real.recording import images
from sling2sim2real.recording.build import Whole
from sling2sim2real.recording.camera import Camera
from sling2sim2real.recording.signals import Signals
from sling2sim2real.recording.streams import Recording, Stream
from sling2sim2real.recording.transforms import Transform
from sling2sim2real.settings import Settings

if TYPE_CHECKING:
    import rerun

NAME, SECONDS = "sling check", "recording"
ARROW = 0.015  # m that a newton is drawn as
PACKED = {b"\xff\xd8": "image/jpeg", b"\x89PNG": "image/png"}
JPEG_QUALITY = 85  # of pictures that come raw
BAND = (255, 0, 255, 150)  # RGBA of the mask


def write_timeline(look: Look, params: Settings, path: Path) -> str:
    """Write an .rrd of what can be shown.

    Returns:
        What was written, in words.

    Raises:
        UserError: where rerun-sdk is missing.
    """
    try:
        import rerun
    except ImportError:
        raise UserError(
            "--rrd: Rerun is not installed: .venv/bin/pip install -e '.[view]' -c constraints.txt"
        ) from None
    if look.recording is None:
        return f"{path} was not written: nothing in the recording can be shown"
    with replacing(path) as temporary:
        stream = rerun.RecordingStream(NAME, recording_id=look.report.sha256[:32])
        stream.set_log_time_enabled(False)
        stream.set_log_tick_enabled(False)
        stream.save(temporary)
        log = _Log(stream, look.recording.origin)
        log.still("report", rerun.TextDocument(look.report.to_text()))
        _raw_force(log, look.recording.wrench)
        _pictures(log, look.recording)
        if look.done and (facts := look.report.signals):
            _scene(log, look.done)
            _motion(log, look.done.signals, facts)
            _clouds(log, look.done, facts.window_start_s, params)
            time = np.array([row.time for row in look.report.coverage])
            log.curve("coverage", time, np.array([row.coverage for row in look.report.coverage]))
        stream.send_blueprint(_layout())
        stream.flush()
        stream.disconnect()
    if look.done:
        return f"{path}: open it with `rerun {path}`"
    return f"{path}: pictures and raw force, all that can be shown"


class _Log:
    """A stream whose clock starts with the first force."""

    def __init__(self, stream: rerun.RecordingStream, origin: int):
        self.stream, self.origin = stream, origin

    def still(self, entity: str, what: object) -> None:
        self.stream.log(entity, what, static=True)

    def at(self, seconds: float, entity: str, what: object) -> None:
        self.stream.set_time(SECONDS, duration=float(seconds))
        self.stream.log(entity, what)

    def columns(self, entity: str, seconds: np.ndarray, columns: object) -> None:
        import rerun

        self.stream.send_columns(entity, [rerun.TimeColumn(SECONDS, duration=seconds)], columns)

    def curve(self, entity: str, seconds: np.ndarray, values: np.ndarray) -> None:
        import rerun

        self.columns(entity, seconds, rerun.Scalars.columns(scalars=values))


def _raw_force(log: _Log, wrench: Stream) -> None:
    for axis, values in zip("xyz", wrench.values.T, strict=True):
        log.curve(f"raw_force/{axis}", wrench.seconds(log.origin), values)


def _pictures(log: _Log, recording: Recording) -> None:
    """All of them, colour as it was recorded where it is packed, depth as PNG in millimetres."""
    import rerun

    for seconds, picture in zip(
        recording.color.seconds(log.origin), recording.color.values, strict=True
    ):
        content, kind = _packed_color(picture)
        if content:
            image = rerun.EncodedImage(contents=content, media_type=kind)
            log.at(seconds, "fork/color/picture", image)
    for seconds, picture in zip(
        recording.depth.seconds(log.origin), recording.depth.values, strict=True
    ):
        try:
            depth = np.clip(np.round(1000 * images.depth(picture)), 0, 65535).astype(np.uint16)
        except images.Undecodable:
            continue
        content = cv2.imencode(".png", depth)[1].tobytes()
        image = rerun.EncodedDepthImage(blob=content, media_type="image/png", meter=1000.0)
        log.at(seconds, "fork/depth/picture", image)


def _packed_color(picture: images.Picture) -> tuple[bytes, str]:
    """A packed picture and its media type; nothing where it is damaged."""
    content = bytes(picture.data) if picture.format else b""
    for start, kind in PACKED.items():
        if content.startswith(start):
            return content, kind
    try:
        color = images.color(picture)
    except images.Undecodable:
        return b"", ""
    quality = [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY]
    return cv2.imencode(".jpg", color, quality)[1].tobytes(), "image/jpeg"


def _scene(log: _Log, done: Whole) -> None:
    """What does not move: fork, cameras, floor's height."""
    import rerun

    scene, geometry = done.scene, done.pull.geometry
    log.still("fork", rerun.ViewCoordinates.RIGHT_HAND_Z_UP)
    posts = [[tip, [*tip[:2], scene.floor]] for tip in scene.tips]
    log.still("fork/posts", rerun.LineStrips3D(posts, colors=[120, 120, 120], radii=0.006))
    log.still("fork/tips", rerun.Points3D(scene.tips, colors=[30, 30, 30], radii=0.008))
    _camera(log, "fork/depth", done.pull.recording.depth_camera, geometry.camera)
    color = geometry.camera @ geometry.color.inverse()
    _camera(log, "fork/color", done.pull.recording.color_camera, color)


def _camera(log: _Log, entity: str, camera: Camera, pose: Transform) -> None:
    import rerun

    at, turn = pose.translation, rerun.Quaternion(xyzw=pose.rotation.as_quat())
    log.still(entity, rerun.Transform3D(translation=at, quaternion=turn))
    size = [camera.width, camera.height]
    pinhole = rerun.Pinhole(image_from_camera=camera.matrix, resolution=size)
    log.still(entity, pinhole)


def _motion(log: _Log, signals: Signals, facts: SignalSummary) -> None:
    """Hand and force sample by sample, as the episode has them."""
    import rerun

    seconds = facts.window_start_s + signals.time
    arrows = ARROW * signals.force
    log.columns("fork/hand", seconds, rerun.Transform3D.columns(translation=signals.position))
    log.still("fork/hand", rerun.Points3D([[0, 0, 0]], colors=[237, 174, 73], radii=0.01))
    log.still("fork/hand/force", rerun.Arrows3D(vectors=[[0, 0, 0]], colors=[209, 73, 91]))
    log.columns("fork/hand/force", seconds, rerun.Arrows3D.columns(vectors=arrows))
    for axis, force, position in zip("xyz", signals.force.T, signals.position.T, strict=True):
        log.curve(f"force/{axis}", seconds, force)
        log.curve(f"position/{axis}", seconds, position)
    log.curve("speed", seconds, np.linalg.norm(signals.velocity, axis=1))
    if np.isfinite(signals.opening).all():
        log.curve("opening", seconds, signals.opening)
    for name, time in (("grasp", facts.grasp_s), ("release", facts.release_s)):
        log.at(time, "events", rerun.TextLog(name, level="INFO"))


def _clouds(log: _Log, done: Whole, start: float, params: Settings) -> None:
    import rerun

    depth, color = done.pull.recording.depth_camera, done.pull.recording.color_camera
    size = (depth.height, depth.width)
    same_view = depth.frame == color.frame and size == (color.height, color.width)
    entity = f"fork/{'color' if same_view else 'depth'}/mask"
    log.still(entity, rerun.AnnotationContext([(0, "", (0, 0, 0, 0)), (1, "band", BAND)]))
    whole = np.zeros(size, np.uint8)
    for (frame, mask), points in zip(
        masked_frames(done, params.cloud), done.clouds.points, strict=True
    ):
        whole[done.view.window] = mask
        log.at(start + frame.time, entity, rerun.SegmentationImage(whole.copy()))
        cloud = rerun.Points3D(points, colors=[0, 121, 140], radii=0.0015)
        log.at(start + frame.time, "fork/cloud", cloud)


def _layout() -> object:
    import rerun.blueprint as views

    def curves(name: str) -> object:
        return views.TimeSeriesView(origin=f"/{name}", name=name)

    return views.Blueprint(
        views.Horizontal(
            views.Vertical(
                views.Spatial2DView(origin="/fork/color", name="colour and mask"),
                views.Spatial2DView(origin="/fork/depth", name="depth"),
            ),
            views.Vertical(
                views.Spatial3DView(origin="/fork", name="frame O"),
                curves("force"),
                curves("coverage"),
                row_shares=[3, 2, 1],
            ),
            views.Tabs(
                views.TextDocumentView(origin="/report", name="report"),
                views.TextLogView(origin="/events", name="events"),
                curves("position"),
                curves("raw_force"),
            ),
        ),
        collapse_panels=True,
    )
