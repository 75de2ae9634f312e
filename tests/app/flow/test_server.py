"""The project's Prefect server: settings as Prefect reads them, where it listens, its history."""

import json
import os
import re
import shutil
import socket
import subprocess
import sys
import urllib.request
from pathlib import Path

import psutil
import pytest

from app.flow import server
from pipeline.base.errors import UserError
from tests.app.flow.serving import SECONDS, ask, serving
from tests.app.flow.test_run import sling
from tests.app.flow.toy import Toy, stage
from tests.project import ROOT, alive, until

HERE = Path(__file__).parent
# Prefect's own reading of every setting, in a process that knows only our environment.
EFFECTIVE = """
import json, sys
import prefect.settings
from prefect.analytics import is_telemetry_enabled
names = json.loads(sys.argv[1])
own = {name: str(getattr(prefect.settings, name).value()) for name in names}
own["telemetry"] = str(is_telemetry_enabled())
print(json.dumps(own))
"""


def environment(**more: str) -> dict[str, str]:
    """Of a process that notes its connections; in no continuous integration, as at a user's."""
    retained = {
        name: text for name, text in os.environ.items() if name not in ("CI", "GITHUB_ACTIONS")
    }
    return {
        **retained,
        "PYTHONPATH": os.pathsep.join([str(HERE / "connections"), str(ROOT)]),
        **more,
    }


def test_each_setting_is_one_of_prefects(tmp_path: Path) -> None:
    settings = server.environment(tmp_path)
    ours = {name: text for name, text in settings.items() if name.startswith("PREFECT_")}
    done = subprocess.run(
        [sys.executable, "-c", EFFECTIVE, json.dumps([*ours])],
        env=environment(**settings, CONNECTIONS=str(tmp_path / "connections")),
        capture_output=True,
        text=True,
        timeout=SECONDS,
    )
    assert done.returncode == 0, done.stderr
    effective = json.loads(done.stdout)
    assert effective.pop("telemetry") == "False"
    connection = effective["PREFECT_SERVER_DATABASE_CONNECTION_URL"]
    if set(connection) == {"*"}:  # Prefect shows no secrets
        effective["PREFECT_SERVER_DATABASE_CONNECTION_URL"] = ours[
            "PREFECT_SERVER_DATABASE_CONNECTION_URL"
        ]
    assert {name: text.lower() for name, text in effective.items()} == {
        name: f"{float(text)}" if text == "1" else text.lower() for name, text in ours.items()
    }
    assert not (tmp_path / "connections").exists()


def test_nobody_elses_settings_are_taken(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setenv("PREFECT_API_URL", "https://api.prefect.cloud")
    monkeypatch.setenv("ALL_PROXY", "socks://127.0.0.1:1")
    clean = server.clean(tmp_path)
    assert "PREFECT_API_URL" not in clean and "ALL_PROXY" not in clean
    assert {name for name in clean if name.startswith("PREFECT_")} < {*server.environment(tmp_path)}


def test_a_stale_note_of_a_port_is_no_server(tmp_path: Path) -> None:
    assert server.address(tmp_path) is None
    (tmp_path / ".prefect").mkdir()
    with socket.create_server(("127.0.0.1", 0)) as other:
        for text in ("1", "x", "99999", str(other.getsockname()[1])):
            (tmp_path / ".prefect" / "port").write_text(text)
            if text != str(other.getsockname()[1]):
                assert server.address(tmp_path) is None


def test_a_port_that_another_program_has_is_refused(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(server, "ASKING", 0.2)
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        with pytest.raises(UserError, match=rf"^port {port} cannot be used .*--port {port + 1}$"):
            server.serve(tmp_path, port)
    with pytest.raises(UserError, match="--port"):
        server.serve(tmp_path, 70000)


def replace_prefect(code: str, folder: Path, patch: pytest.MonkeyPatch) -> None:
    """Have `python -m prefect` run another one."""
    (folder / "prefect").mkdir()
    (folder / "prefect/__init__.py").touch()
    (folder / "prefect/__main__.py").write_text(code)
    patch.setenv("PYTHONPATH", str(folder))


def test_a_deaf_server_whose_guard_was_killed_ends_all_the_same(tmp_path, monkeypatch) -> None:
    """As one is that has just begun to start."""
    deaf = "import pathlib, signal, time; signal.signal(signal.SIGINT, signal.SIG_IGN)"
    deaf += "; pathlib.Path(__file__).with_name('ready').touch(); time.sleep(60)"
    replace_prefect(deaf, tmp_path, monkeypatch)
    monkeypatch.setattr(server, "_home_at", lambda port: server.home(tmp_path))
    monkeypatch.setattr(server.guard, "GRACE", 0.5)
    with server._server(tmp_path, 1) as guard:
        until((tmp_path / "prefect/ready").exists)
        pid = int((tmp_path / ".prefect/server.log").read_text().split()[0])
        guard.kill()
        assert alive(pid)
    until(lambda: not alive(pid), 5)


def test_a_server_that_a_full_disk_keeps_from_starting_is_said_so(tmp_path, monkeypatch) -> None:
    replace_prefect("raise SystemExit(1)", tmp_path, monkeypatch)
    usage = shutil.disk_usage(tmp_path)
    for free, message in ((10_000, "No space left on device"), (10**8, "server.log says why")):
        disk = usage._replace(free=free)
        monkeypatch.setattr(shutil, "disk_usage", lambda _, disk=disk: disk)
        with pytest.raises(UserError, match=message), server._server(tmp_path, 1):
            pass


def listening(pid: int) -> set[tuple[str, int]]:
    family = [psutil.Process(pid), *psutil.Process(pid).children(recursive=True)]
    sockets = [connection for process in family for connection in process.net_connections("inet")]
    return {
        (connection.laddr.ip, connection.laddr.port)
        for connection in sockets
        if connection.status == psutil.CONN_LISTEN
    }


@pytest.mark.slow
def test_the_ui_is_this_projects_alone_and_shows_its_runs(tmp_path: Path, history) -> None:
    """Those that were, and the one that is."""
    stages = {"top": stage("top", "word"), "low": stage("low", "top.out")}
    toy, other = Toy(tmp_path / "mine", stages, word="one\n"), tmp_path / "other"
    other.mkdir()
    root = toy.folder
    shutil.copytree(history, root / ".prefect")  # of an earlier server
    assert sling(toy).returncode == 0
    with serving(root, environment(CONNECTIONS=str(root / "connections"))) as (url, process):
        port = int(url.rpartition(":")[2])
        assert listening(process.pid) == {("127.0.0.1", port)}
        assert f"Prefect UI: {url}" in (root / "said").read_text()
        assert url in server.serve(root)  # says where it runs
        with pytest.raises(UserError, match=f"{port}.*the Prefect server of {root}.*--port"):
            server.serve(other, port)
        assert server.address(other) is None
        ui = ask(url, "/ui-settings")
        assert (ui["api_url"], ui["default_ui"]) == (f"{url}/api", "v1")
        for where in (url, f"{url}/v2/"):
            with urllib.request.urlopen(where, timeout=SECONDS) as page:
                text = page.read().decode()
            (allowed,) = re.findall(r'http-equiv="Content-Security-Policy" content="(.*?)"', text)
            assert set(re.findall(r"\w+://(\S+)", allowed)) == {"127.0.0.1:*"}
            assert text.index(allowed) < text.index("<script") and "Prefect" in text
        settings = ask(url, "/api/admin/settings")["server"]
        assert settings["analytics_enabled"] is settings["ui"]["show_promotional_content"] is False

        def shown() -> list[dict]:
            return ask(url, "/api/flow_runs/filter", {"sort": "START_TIME_ASC"})

        def states() -> list[str]:
            return [run["state_name"] for run in shown()]

        until(lambda: states() == ["Completed"], SECONDS)
        (root / "word").write_text("bad\n")
        assert f"seen at {url}" in sling(toy).stderr
        until(lambda: states() == ["Completed", "Failed"], SECONDS)
        graph = ask(url, f"/api/flow_runs/{shown()[0]['id']}/graph-v2")
        nodes = {node["label"]: node for _, node in graph["nodes"]}
        assert [node["id"] for node in nodes["low"]["parents"]] == [nodes["top"]["id"]]
        message = ask(url, "/api/logs/filter", {})
        assert {"top works", "error: word: says bad; write something else"} <= {
            record["message"] for record in message
        }
    assert not (root / "connections").exists(), (root / "connections").read_text()
