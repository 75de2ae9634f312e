"""Prefect, for this project alone: its history is SQLite in .prefect/, and it reports to nobody."""

from __future__ import annotations

import json
import os
import socket
import sys
import urllib.request
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path

from pipeline.base.errors import UserError
from pipeline.base.files import write_text

HOST, PORT = "127.0.0.1", 4200
ASKING = 5.0  # s that a server has to answer


def environment(root: Path) -> dict[str, str]:
    """This process's environment with the project's settings of Prefect, and nobody else's.

    To be set before `prefect` is imported. The server is that of `sling ui` where it runs, else
    Prefect starts one for the process. Without proxies: it is here, and Prefect's client refuses to
    start by those of SOCKS.
    """
    foreign = [n for n in os.environ if n.startswith("PREFECT_") or n.lower().endswith("_proxy")]
    where = address(root)
    return {name: text for name, text in os.environ.items() if name not in foreign} | {
        **({"PREFECT_API_URL": f"{where}/api"} if where else {}),
        "PREFECT_HOME": str(_home(root)),
        "PREFECT_SERVER_EPHEMERAL_STARTUP_TIMEOUT_SECONDS": "120",
        "PREFECT_SERVER_UI_STATIC_DIRECTORY": str(_home(root) / "ui"),  # not in site-packages
        "PREFECT_SERVER_ANALYTICS_ENABLED": "false",
        "DO_NOT_TRACK": "1",  # the same, elsewhere in Prefect
        "PREFECT_SERVER_UI_V2_ENABLED": "false",  # V1 asks nobody, and has stages beside log lines
        "PREFECT_SERVER_UI_SHOW_PROMOTIONAL_CONTENT": "false",
        "PREFECT_LOGGING_HANDLERS_CONSOLE_LEVEL": "CRITICAL",  # the terminal has stages' lines
    }


def serve(root: Path, port: int = PORT) -> str:
    """Become Prefect's server, or say where the project's runs already. Raises UserError."""
    if find_spec("prefect") is None:
        raise ModuleNotFoundError(name="prefect")
    if where := address(root):
        return f"the UI of this project runs already: {where}"
    try:
        socket.create_server((HOST, port)).close()
    except (OSError, OverflowError) as error:
        why = os.strerror(error.errno or 0) if isinstance(error, OSError) else error
        raise UserError(f"--port {port}: cannot be used ({why}); give another one") from error
    url = f"http://{HOST}:{port}"
    _home(root).mkdir(exist_ok=True)
    write_text(_home(root) / "address", url)
    command = ["-P", "-m", "prefect", "server", "start", "--host", HOST, "--port", str(port)]
    settings = environment(root) | {"PREFECT_UI_API_URL": f"{url}/api"}
    print(f"Prefect UI: {url} (Ctrl-C ends it)", file=sys.stderr, flush=True)
    os.execve(sys.executable, [sys.executable, *command], settings)


def address(root: Path) -> str | None:
    """URL of the server that serves this project now, as it says itself; None without one."""
    direct = urllib.request.build_opener(urllib.request.ProxyHandler({}))
    with suppress(OSError, ValueError, KeyError, TypeError):
        where = (_home(root) / "address").read_text(encoding="utf-8")
        with direct.open(f"{where}/api/admin/settings", timeout=ASKING) as answer:
            return where if json.load(answer)["home"] == str(_home(root)) else None
    return None


def _home(root: Path) -> Path:
    """Where all of Prefect's files of a project lie."""
    return root.resolve() / ".prefect"
