"""A folder of CSV files gives the episode of its arrays, or one line about what is wrong."""

import shutil

import numpy as np
import open3d
import pandas as pd
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sling2sim2real import UserError, episode_from_arrays, episode_from_csv
from tests.api.toy import still

FILES = "episode.yaml", "pose.csv", "force.csv", "clouds/10.000.npy", "clouds/10.100.ply"


@pytest.fixture(scope="module")
def arrays() -> dict:
    rng = np.random.default_rng(0)
    arrays = still(np.arange(10, 15, 0.01), release=14.0)
    arrays["position"] += rng.normal(0, 1e-3, arrays["position"].shape)
    arrays["clouds"] = [rng.random((5, 3)).astype(np.float32) for _ in arrays["cloud_time"]]
    return arrays


@pytest.fixture(scope="module")
def folder(arrays, tmp_path_factory):
    """Every other cloud as PLY."""
    folder = tmp_path_factory.mktemp("csv") / "pull"
    (folder / "clouds").mkdir(parents=True)
    time = arrays["time"]
    for name, columns, values in (
        ("pose", ["x", "y", "z"], arrays["position"]),
        ("force", ["fx", "fy", "fz"], arrays["force"]),
    ):
        table = pd.DataFrame(values, columns=columns)
        table.insert(0, "time", time)
        table.to_csv(folder / f"{name}.csv", index=False)
    for number, (at, cloud) in enumerate(zip(arrays["cloud_time"], arrays["clouds"], strict=True)):
        if number % 2:
            points = open3d.utility.Vector3dVector(cloud.astype(float))
            path = str(folder / f"clouds/{at:.3f}.ply")
            open3d.io.write_point_cloud(path, open3d.geometry.PointCloud(points))
        else:
            np.save(folder / f"clouds/{at:.3f}.npy", cloud)
    (folder / "episode.yaml").write_text(
        "camera: [0.8, 0.3, 0.5]\ngrasp_time: 12\nrelease_time: 14.0\nrelease_error: 0.002\n"
    )
    return folder


def test_it_is_the_episode_of_the_arrays(arrays, folder) -> None:
    read = episode_from_csv(folder)
    truth = episode_from_arrays(**arrays, release_error=2e-3)
    for name in ("time", "position", "velocity", "force", "cloud_time", "camera"):
        np.testing.assert_allclose(getattr(read, name), getattr(truth, name), atol=1e-9)
    for cloud, true in zip(read.clouds, truth.clouds, strict=True):
        np.testing.assert_allclose(cloud, true, atol=1e-6)
    assert (read.grasp_time, read.metadata) == (truth.grasp_time, truth.metadata)


def changed(folder, tmp_path, name: str, content: bytes | None):
    """A copy, in which a file holds something else, or is not there."""
    copy = tmp_path / "copy"
    shutil.rmtree(copy, ignore_errors=True)
    shutil.copytree(folder, copy)
    (copy / name).unlink(missing_ok=True)
    if content is not None:
        (copy / name).write_bytes(content)
    return copy


@pytest.mark.parametrize(
    ("name", "content", "expected"),
    [
        ("pose.csv", None, "pose.csv: cannot be read"),
        (
            "pose.csv",
            b"time,x,y\n0,0,0\n",
            r"pose.csv: must have one column each of .* not \['z'\]",
        ),
        (
            "force.csv",
            b"time,fx,fy,fz\n1,0,0,0\n2,0,a,0\n",
            "force.csv, line 3: fy is no number: 'a'",
        ),
        (
            "force.csv",
            b"time,fx,fy,fz\n1,0,0,0\n1,0,0,0\n",
            "force.csv, line 3: time does not incr",
        ),
        ("episode.yaml", b"camera: [1, 2, 3]\ngrasp: 1", "episode.yaml: grasp: unknown key"),
        ("clouds/first.npy", b"", "first.npy: its name must be a stamp"),
        (
            "clouds/10.100.ply",
            b"ply\nelement vertex 7\nend_header\n",
            r"10.100.ply: must hold finite",
        ),
    ],
)
def test_what_is_wrong_is_one_line(folder, tmp_path, name, content, expected) -> None:
    with pytest.raises(UserError, match=expected) as caught:
        episode_from_csv(changed(folder, tmp_path, name, content))
    assert "\n" not in str(caught.value)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(name=st.sampled_from(FILES), data=st.data())
def test_a_damaged_file_is_read_or_refused_in_one_line(folder, tmp_path, name, data) -> None:
    content = bytearray((folder / name).read_bytes())
    at = data.draw(st.integers(0, len(content) - 1))
    end = data.draw(st.integers(at, min(at + 400, len(content))))
    content[at:end] = data.draw(st.binary(max_size=4))
    try:
        episode_from_csv(changed(folder, tmp_path, name, bytes(content)))
    except UserError as error:
        assert "\n" not in str(error) and str(tmp_path) in str(error)
