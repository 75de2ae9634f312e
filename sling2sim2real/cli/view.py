"""`sling view`: a band in Rerun's viewer: its first pull, recorded and simulated; its launches.

Space is frame O, and seconds are those of the episode. https://rerun.io
"""

# Rerun is an extra.
# pyright: reportMissingImports=false
from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import numpy as np

from sling2sim2real.api.band_folder import BandFolder
from sling2sim2real.api.identification import Identification
from sling2sim2real.api.launching import draw_for
from sling2sim2real.base.errors import Refused, UserError
from sling2sim2real.base.files import NotMade, replacing
from sling2sim2real.card.camera import Pictures
from sling2sim2real.card.simulated import Simulated, simulate
from sling2sim2real.episode.episode import Episode
from sling2sim2real.launching.flight import flight

SECONDS = "recording"  # the timeline
MEASURED, SIMULATED = (34, 34, 34), (224, 0, 122)  # RGB, as on the card
JPEG_QUALITY = 85


def view(folder: BandFolder, save: Path | None = None) -> str:
    """Open the viewer, or write what it shows into a file .rrd; return what was done, in words.

    Raises:
        UserError: The folder keeps no episode.
    """
    import rerun

    found, episode = Identification.load(folder.path), folder.first_episode
    if episode is None:
        raise UserError(f"{folder.path}: keeps no episode; `sling fit {folder.path}` makes it")
    simulated = simulate(found, episode)
    stream = rerun.RecordingStream("sling view", recording_id=folder.digest[:32])
    stream.set_log_time_enabled(False)
    stream.set_log_tick_enabled(False)
    layout = _layout()
    if save is None:
        stream.spawn(default_blueprint=layout)
        _log(stream, folder, found, episode, simulated)
        return f"{folder.path}: shown in Rerun's viewer"
    with replacing(save) as temporary:
        stream.save(temporary, default_blueprint=layout)
        _log(stream, folder, found, episode, simulated)
        stream.flush()
        stream.disconnect()
    return f"{save}: open it with `rerun {save}`"


def _layout() -> Any:
    """Space and picture, one plot for each component of the force, the card."""
    from rerun import blueprint

    forces = (
        blueprint.TimeSeriesView(origin=f"force_{axis}", name=f"force {axis} [N]") for axis in "yzx"
    )
    return blueprint.Blueprint(
        blueprint.Horizontal(
            blueprint.Vertical(
                blueprint.Spatial3DView(origin="fork", name="frame O"),
                blueprint.Spatial2DView(origin="fork/camera", name="camera"),
            ),
            blueprint.Vertical(*forces),
            blueprint.TextDocumentView(origin="card", name="card"),
        ),
        collapse_panels=True,
    )


def _log(
    stream: Any, folder: BandFolder, found: Identification, episode: Episode, simulated: Simulated
) -> None:
    import rerun

    def still(entity: str, what: Any) -> None:
        stream.log(entity, what, static=True)

    def at(seconds: float, entity: str, what: Any) -> None:
        stream.set_time(SECONDS, duration=float(seconds))
        stream.log(entity, what)

    def curves(entity: str, force: np.ndarray) -> None:
        times = [rerun.TimeColumn(SECONDS, duration=episode.time)]
        for axis, values in zip("xyz", force.T, strict=True):
            columns = rerun.Scalars.columns(scalars=values)
            stream.send_columns(f"force_{axis}/{entity}", times, columns)

    setup, floor = found.settings.setup, -found.settings.setup.fork_height
    half = setup.fork_width / 2
    posts = [[[x, 0, 0], [x, 0, floor]] for x in (-half, half)]
    still("fork", rerun.ViewCoordinates.RIGHT_HAND_Z_UP)
    still("fork/posts", rerun.LineStrips3D(posts, colors=[120, 120, 120], radii=0.006))
    curves("measured", episode.force)
    curves("simulated", simulated.force)
    for name, time in (("grasp", episode.grasp_time), ("release", simulated.release)):
        at(time, "events", rerun.TextLog(name))
    for time, hand in zip(episode.time, episode.position, strict=True):
        at(time, "fork/hand", rerun.Points3D([hand], colors=MEASURED, radii=0.01))
    for time, cloud in zip(episode.cloud_time + simulated.camera, episode.clouds, strict=True):
        at(time, "fork/cloud", rerun.Points3D(cloud, colors=MEASURED, radii=0.0015))
    for time in simulated.time:
        line = rerun.LineStrips3D([simulated.line(time)], colors=SIMULATED, radii=0.003)
        at(time, "fork/simulated", line)
    _camera(folder, episode, simulated, still, at)
    _launches(folder, found, floor, still)
    if (card := folder.card / "README.md").is_file():
        lines = card.read_text("utf-8").splitlines(keepends=True)
        text = "".join(
            line for line in lines if not line.startswith("![")
        )  # pictures lie elsewhere
        still("card", rerun.TextDocument(text, media_type="text/markdown"))


def _camera(folder: BandFolder, episode: Episode, simulated: Simulated, still, at) -> None:
    """The pictures that the card shows, and where the camera stands."""
    import rerun

    try:
        kept = folder.episodes(folder.recordings[0]) / "pictures"
        pictures = Pictures.load(kept, episode)
    except NotMade:
        return
    pose = pictures.pose.inverse()
    turn = rerun.Quaternion(xyzw=pose.rotation.as_quat())
    still("fork/camera", rerun.Transform3D(translation=pose.translation, quaternion=turn))
    size = [pictures.camera.width, pictures.camera.height]
    lens = rerun.Pinhole(image_from_camera=pictures.camera.matrix, resolution=size)
    still("fork/camera", lens)
    for number, time in enumerate(pictures.time + simulated.camera):
        if (image := pictures[number]) is not None:
            quality = [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY]
            content = cv2.imencode(".jpg", image, quality)[1].tobytes()
            picture = rerun.EncodedImage(contents=content, media_type="image/jpeg")
            at(time, "fork/camera/picture", picture)


def _launches(folder: BandFolder, found: Identification, floor: float, still) -> None:
    """Flights to the targets as they are expected, and where measured launches landed."""
    import rerun

    ways, draws = [], []
    for target in found.settings.trials.targets:
        try:
            draw = draw_for(found, target)
        except Refused:  # no draw lands
            continue
        done = found.launches(draw)
        if done.failure[0] is None:
            at = float(done.separation_y[0]), float(done.separation_z[0])
            y, z = flight(*at, float(done.speed[0]), float(done.angle[0]), floor)
            ways.append(np.stack([0 * y, y, z], axis=1))
            draws.append([0, *draw])
    landed = [[0, row.landing, floor] for row in folder.launches if row.landing is not None]
    still("fork/launches/expected", rerun.LineStrips3D(ways, colors=SIMULATED, radii=0.003))
    still("fork/launches/draws", rerun.Points3D(draws, colors=SIMULATED, radii=0.008))
    still("fork/launches/measured", rerun.Points3D(landed, colors=MEASURED, radii=0.015))
