"""The project's own Prefect server: its history is SQLite in .prefect/, it listens on this machine
alone, and it reports to nobody.

`sling ui` serves until Ctrl-C; `served` is that server, or else one that ends with the caller.
"""

from __future__ import annotations

import contextlib
import json
import os
import select
import socket
import subprocess
import sys
import threading
import time
import urllib.request
from collections.abc import Callable, Iterator
from pathlib import Path

from pipeline.base.errors import UserError
from pipeline.base.files import write_text

HOST, PORT = "127.0.0.1", 4200
STARTING, ENDING, ASKING = 120.0, 15.0, 5.0  # s, that a server may take to do so, and to answer
ROOT = Path(__file__).parents[2]
# What the browser may load and ask: the V2 UI would ask a counter of visits for its settings,
# whether or not telemetry is off.
POLICY = (
    f"default-src 'self' 'unsafe-inline' 'unsafe-eval' data: blob: http://{HOST}:* ws://{HOST}:*"
).encode()


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
    } | {name: _not_by_proxy(name) for name in ("no_proxy", "NO_PROXY")}


def _not_by_proxy(name: str) -> str:
    others = [one for one in os.environ.get(name, "").split(",") if one and one != HOST]
    return ",".join([*others, HOST])


def clean(root: Path) -> dict[str, str]:
    """This process's environment with the project's Prefect settings and nobody else's."""
    kept = {name: text for name, text in os.environ.items() if not name.startswith("PREFECT_")}
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
    with _listening(PORT if port is None else port) as listener:
        note = home(root) / "port"

        def ready(url: str) -> None:
            write_text(note, str(listener.getsockname()[1]))
            print(f"Prefect UI: {url} (Ctrl-C ends it)", file=sys.stderr, flush=True)

        _take(clean(root))
        try:
            _run(listener, ready)
        finally:
            note.unlink(missing_ok=True)
    return "the UI has ended; its history stays in .prefect/"


def _listening(port: int) -> socket.socket:
    """A socket on the loopback alone. Raises UserError, which says who has the port."""
    listener = socket.socket()
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((HOST, port))
    except OSError as error:
        listener.close()
        other = _home_at(port)
        who = (
            f"the Prefect server of {other.parent}" if other else (error.strerror or "not allowed")
        )
        raise UserError(
            f"port {port} cannot be used ({who}); give another one: sling ui --port {port + 1}"
        ) from error
    except OverflowError as error:
        listener.close()
        raise UserError(f"--port: must be 1 to 65535, got {port}") from error
    return listener


def _run(
    listener: socket.socket,
    ready: Callable[[str], None],
    ended: Callable[[], None] | None = None,
) -> None:
    """Serve on a bound socket until Ctrl-C, SIGTERM, or until `ended` returns in its thread."""
    url = _url(listener.getsockname()[1])
    os.environ["PREFECT_UI_API_URL"] = f"{url}/api"
    import uvicorn
    from prefect.server.api.server import create_app

    class Server(uvicorn.Server):
        async def startup(self, sockets: list[socket.socket] | None = None) -> None:
            await super().startup(sockets)
            ready(url)

    app = _only_here(create_app(final=True))
    server = Server(uvicorn.Config(app, log_level="warning", timeout_graceful_shutdown=3))
    if ended:

        def end() -> None:
            ended()
            server.should_exit = True
            time.sleep(ENDING)
            os._exit(1)  # it hangs

        threading.Thread(target=end, daemon=True).start()
    with contextlib.suppress(KeyboardInterrupt):  # uvicorn has shut down by then
        server.run(sockets=[listener])


def _only_here(app):
    """An ASGI application whose pages have `POLICY`."""

    async def answer(scope, receive, send) -> None:
        async def send_on(message) -> None:
            if message["type"] == "http.response.start":
                policy = (b"content-security-policy", POLICY)
                message = {**message, "headers": [*message.get("headers", ()), policy]}
            await send(message)

        await app(scope, receive, send_on)

    return answer


@contextlib.contextmanager
def served(root: Path) -> Iterator[str]:
    """Set this process up for Prefect, and give the URL of the project's UI.

    It is that of `sling ui`, or of a server that ends with the block, or with this process however
    that ends. To be entered before `prefect` is imported. Raises UserError.
    """
    where = address(root)
    with contextlib.ExitStack() as stack:
        where = where or stack.enter_context(_temporary(root))
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


@contextlib.contextmanager
def _temporary(root: Path) -> Iterator[str]:
    log = home(root) / "server.log"
    log.parent.mkdir(parents=True, exist_ok=True)
    with log.open("w", encoding="utf-8") as said:
        process = subprocess.Popen(
            [sys.executable, "-m", "app.flow.server"],
            cwd=ROOT,
            env=clean(root),
            stdin=subprocess.PIPE,  # its end is ours: a killed flow leaves no server
            stdout=subprocess.PIPE,
            stderr=said,
            text=True,
            start_new_session=True,  # Ctrl-C is ours: the flow's last words are to be kept
        )
    try:
        yield _first_line(process, log)
    finally:
        process.stdin.close()
        try:
            process.wait(ENDING)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        process.stdout.close()


def _first_line(process: subprocess.Popen, log: Path) -> str:
    deadline = time.monotonic() + STARTING
    while time.monotonic() < deadline and process.poll() is None:
        if select.select([process.stdout], [], [], 0.2)[0]:
            line = process.stdout.readline().strip()
            if line:
                return line
    raise UserError(f"Prefect's server does not start; {log} says why")


def main() -> None:
    """A server on any free port, for as long as stdin is open; stdout gets its URL."""
    with _listening(0) as listener:
        _run(listener, lambda url: print(url, flush=True), ended=_until_closed)


def _until_closed() -> None:
    while os.read(0, 1):  # not sys.stdin, whose lock a daemon thread would hold to the end
        pass


if __name__ == "__main__":
    main()
