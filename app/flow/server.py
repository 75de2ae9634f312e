"""The project's own Prefect server: its history is SQLite in .prefect/, it listens on this machine
alone, and it reports to nobody.

It is `prefect server start` behind a guard, so that it ends with whoever started it. `sling ui`
serves until Ctrl-C; `served` is that server, or else one that ends with the caller.
"""

from __future__ import annotations

import contextlib
import json
import os
import socket
import subprocess
import sys
import time
import urllib.request
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
        "DO_NOT_TRACK": "1",  # the same, of Prefect's clients
        "PREFECT_SERVER_UI_V2_ENABLED": "false",  # V1 asks nobody, and has stages beside log lines
        "PREFECT_SERVER_UI_SHOW_PROMOTIONAL_CONTENT": "false",
        "PREFECT_CLIENT_SERVER_VERSION_CHECK_ENABLED": "false",  # one package is both
        "PREFECT_CLIENT_MAX_RETRIES": "3",  # some 14 s without a server; the default is a minute
        "PREFECT_SERVER_LOGGING_LEVEL": "WARNING",
        "PREFECT_INTERNAL_LOGGING_LEVEL": "CRITICAL",  # no words of a server that is gone
        "PREFECT_LOGGING_TO_API_BATCH_INTERVAL": "1",  # s, until lines show
        "PREFECT_LOGGING_HANDLERS_CONSOLE_LEVEL": "CRITICAL",  # the flow prints for itself
    }


def clean(root: Path) -> dict[str, str]:
    """This process's environment with the project's Prefect settings and nobody else's.

    Without proxies: the server is here, and Prefect's client refuses to start by those of SOCKS.
    """
    kept = {
        name: text
        for name, text in os.environ.items()
        if not name.startswith("PREFECT_") and not name.lower().endswith("_proxy")
    }
    return kept | environment(root)


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
            server.wait()
        finally:
            note.unlink(missing_ok=True)
        raise UserError(f"Prefect's server has ended; {_log(root)} says why")
    return "the UI has ended; its history stays in .prefect/"


def expect_free(port: int) -> None:
    """Raises UserError, which says who has the port."""
    try:
        _bound(port).close()
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


def _bound(port: int) -> socket.socket:
    return socket.create_server((HOST, port))


@contextlib.contextmanager
def served(root: Path) -> Iterator[str]:
    """Set this process up for Prefect, and give the URL of the project's UI.

    It is that of `sling ui`, or of a server that ends with the block, or with this process however
    that ends. To be entered before `prefect` is imported. Raises UserError.
    """
    where = address(root)
    with contextlib.ExitStack() as stack:
        if not where:
            with _bound(0) as listener:
                port = listener.getsockname()[1]
            stack.enter_context(_server(root, port))
            where = _url(port)
        before = dict(os.environ)
        _take(clean(root) | {"PREFECT_API_URL": f"{where}/api"})
        try:
            yield where
        finally:
            _take(before)


def _take(environment: dict[str, str]) -> None:
    """Make this process's environment so."""
    for name in os.environ.keys() - environment.keys():
        del os.environ[name]
    os.environ.update(environment)


def _log(root: Path) -> Path:
    return home(root) / "server.log"


@contextlib.contextmanager
def _server(root: Path, port: int) -> Iterator[subprocess.Popen]:
    """Prefect's server on a free port, from when it answers to the end of the block, or ours."""
    start = ["-P", "-m", "prefect", "server", "start", "--host", HOST, "--port", str(port)]
    home(root).mkdir(parents=True, exist_ok=True)
    with _log(root).open("w", encoding="utf-8") as said:
        process = guard.start(
            [sys.executable, *start],
            env=clean(root) | {"PREFECT_UI_API_URL": f"{_url(port)}/api"},
            stdout=said,
            stderr=said,
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
