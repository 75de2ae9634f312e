"""The project's own Prefect server: its history is SQLite in .prefect/, it listens on this machine
alone, and it reports to nobody.

It is `prefect server start` behind a guard, so that it ends with `sling ui`, which serves until
Ctrl-C and shows what is in the logs of runs meanwhile.
"""

from __future__ import annotations

import asyncio
import contextlib
import importlib.util
import json
import os
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

from app.flow import guard
from app.flow.disk import expect_room, expect_writable
from pipeline.base.errors import UserError
from pipeline.base.files import write_text

HOST, PORT = "127.0.0.1", 4200
STARTING, ASKING = 120.0, 5.0  # s, that a server may take to start, and to answer
# What a page may load and ask: the V2 UI, to which a user may switch, would ask a counter of visits
# on the Internet for its settings, whether or not telemetry is off.
POLICY = (
    "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'self' 'unsafe-inline'"
    f" 'unsafe-eval' data: blob: http://{HOST}:* ws://{HOST}:*\">"
)


def home(root: Path) -> Path:
    """Where all of Prefect's files of a project lie."""
    return Path(root).resolve() / ".prefect"


def environment(root: Path) -> dict[str, str]:
    """Settings of Prefect for this project; they must be set before `prefect` is imported."""
    folder = home(root)
    return {
        "PREFECT_HOME": str(folder),
        "PREFECT_SERVER_DATABASE_CONNECTION_URL": f"sqlite+aiosqlite:///{folder}/prefect.db",
        "PREFECT_SERVER_UI_STATIC_DIRECTORY": str(folder / "ui"),  # not in site-packages
        "PREFECT_SERVER_API_HOST": HOST,
        "PREFECT_SERVER_ANALYTICS_ENABLED": "false",
        "DO_NOT_TRACK": "1",  # the same, elsewhere in Prefect
        "PREFECT_SERVER_UI_V2_ENABLED": "false",  # V1 asks nobody, and has stages beside log lines
        "PREFECT_SERVER_UI_SHOW_PROMOTIONAL_CONTENT": "false",
        "PREFECT_SERVER_LOGGING_LEVEL": "WARNING",
        "PREFECT_INTERNAL_LOGGING_LEVEL": "CRITICAL",  # no words of a server that is gone
    }


def clean(root: Path) -> dict[str, str]:
    """This process's environment with the project's Prefect settings and nobody else's.

    Without proxies: the server is here, and Prefect's client refuses to start by those of SOCKS.
    """
    options = {
        name: text
        for name, text in os.environ.items()
        if not name.startswith("PREFECT_") and not name.lower().endswith("_proxy")
    }
    return options | environment(root)


def address(root: Path) -> str | None:
    """URL of the UI that `sling ui` serves for this project now; None without one."""
    try:
        port = int((home(root) / "port").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return _url(port) if _home_at(port) == home(root) else None


def _url(port: int) -> str:
    return f"http://{HOST}:{port}"


def _home_at(port: int) -> Path | None:
    """Whose Prefect server listens on a port, as it says itself; None: no one's."""
    import urllib.request  # takes its time, and few ask

    direct = urllib.request.build_opener(urllib.request.ProxyHandler({}))
    try:
        with direct.open(f"{_url(port)}/api/admin/settings", timeout=ASKING) as answer:
            return Path(json.load(answer)["home"])
    except (OSError, ValueError, KeyError, TypeError):
        return None


def serve(root: Path, port: int | None = None) -> str:
    """Serve the UI until Ctrl-C, or say where it runs already. Raises UserError.

    Args:
        port: Default 4200.
    """
    if importlib.util.find_spec("prefect") is None:  # else only a log would say that it is absent
        raise ModuleNotFoundError(name="prefect")
    where = address(root)
    if where:
        return f"the UI of this project runs already: {where}"
    port = PORT if port is None else port
    expect_free(port)
    expect_writable(home(root), *home(root).glob("*"))
    note = home(root) / "port"
    with contextlib.suppress(KeyboardInterrupt), _server(root, port) as server:
        write_text(note, str(port))
        try:
            print(f"Prefect UI: {_url(port)} (Ctrl-C ends it)", file=sys.stderr, flush=True)
            settings = clean(root)
            os.environ.clear()
            os.environ.update(settings)  # before Prefect is imported
            from app.flow.follow import follow

            asyncio.run(follow(root, lambda: server.poll() is None))
        finally:
            note.unlink(missing_ok=True)
        raise UserError(f"Prefect's server has ended; {_log(root)} says why")
    return "the UI has ended; its history stays in .prefect/"


def expect_free(port: int) -> None:
    """Raises UserError, which says who has the port."""
    try:
        socket.create_server((HOST, port)).close()
    except OSError as error:
        other = _home_at(port)
        who = (
            f"the Prefect server of {other.parent}" if other else (error.strerror or "not allowed")
        )
        raise UserError(
            f"port {port} cannot be used ({who}); give another one: sling ui --port {port + 1}"
        ) from error
    except OverflowError as error:
        raise UserError(f"--port: must be 1 to 65535, got {port}") from error


def _log(root: Path) -> Path:
    return home(root) / "server.log"


@contextlib.contextmanager
def _server(root: Path, port: int) -> Iterator[subprocess.Popen]:
    """Prefect's server on a free port, from when it answers to the end of the block, or ours."""
    start = ["-P", "-m", "prefect", "server", "start", "--host", HOST, "--port", str(port)]
    home(root).mkdir(parents=True, exist_ok=True)
    with _log(root).open("w", encoding="utf-8") as message:
        process = guard.start(
            [sys.executable, *start],
            env=clean(root) | {"PREFECT_UI_API_URL": f"{_url(port)}/api"},
            stdout=message,
            stderr=message,
        )

    def group() -> int:  # a server that just starts may be deaf
        first = _log(root).read_text(encoding="utf-8", errors="replace").partition("\n")[0]
        return int(first) if first.isdecimal() else 0

    try:
        deadline = time.monotonic() + STARTING
        while _home_at(port) != home(root):
            if time.monotonic() > deadline or process.poll() is not None:
                expect_room(home(root))  # its log has none to say so
                raise UserError(f"Prefect's server does not start; {_log(root)} says why")
            time.sleep(0.2)
        for page in (home(root) / "ui").glob("*/index.html"):
            text = page.read_text(encoding="utf-8")
            if POLICY not in text:
                write_text(page, text.replace("<head>", f"<head>{POLICY}", 1))
        yield process
    finally:
        guard.end(process, group)
