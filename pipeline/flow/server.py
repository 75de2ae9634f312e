"""`sling ui`: serve the Prefect UI, with past and present runs, for this machine alone.

    python -m pipeline.flow.server [--port N]

Prefect is this project's alone: its history is SQLite in .prefect/, and it reports to nobody.
"""

from __future__ import annotations

import json
import os
import socket
import sys
import urllib.request
from contextlib import suppress
from importlib import import_module
from pathlib import Path

from sling2sim2real.base import errors
from sling2sim2real.base.errors import UserError
from sling2sim2real.cli import arguments as kinds
from sling2sim2real.cli.command_line import Parser

HOST, PORT = "127.0.0.1", 4200
ASKING = 5.0  # s that a server has to answer


def configure(root: Path) -> None:
    """Give this process the project's settings of Prefect, which is not imported yet.

    The server is that of `sling ui` where it runs, else Prefect starts one for the process. Nobody
    else's settings count. Without proxies: the server is here, and Prefect's client refuses to
    start by those of SOCKS.
    """
    for name in [n for n in os.environ if n.startswith("PREFECT_") or n.lower().endswith("_proxy")]:
        del os.environ[name]
    if where := address(root):
        os.environ["PREFECT_API_URL"] = f"{where}/api"
    os.environ |= {
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
    if where := address(root):
        return f"the UI of this project runs already: {where}"
    try:
        socket.create_server((HOST, port)).close()
    except (OSError, OverflowError) as error:
        raise UserError(f"--port {port}: cannot be used, give another one: {error}") from error
    url = f"http://{HOST}:{port}"
    _home(root).mkdir(exist_ok=True)
    (_home(root) / "address").write_text(url, encoding="utf-8")
    configure(root)
    os.environ["PREFECT_UI_API_URL"] = f"{url}/api"
    import_module("prefect")  # or an error that says how to install it
    print(f"Prefect UI: {url} (Ctrl-C ends it)", file=sys.stderr, flush=True)
    command = ["-P", "-m", "prefect", "server", "start", "--host", HOST, "--port", str(port)]
    os.execv(sys.executable, [sys.executable, *command])


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


def parser() -> Parser:
    """Command line of `sling ui`."""
    parser = Parser(prog="sling ui", description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--port", type=kinds.count, metavar="N", default=PORT, help="of the UI")
    return parser


if __name__ == "__main__":
    errors.run(lambda: print(serve(Path.cwd(), parser().parse_args().port)))
