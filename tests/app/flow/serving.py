"""A project's Prefect server by `sling ui`, and what its API answers."""

import json
import os
import signal
import socket
import subprocess
import sys
import urllib.request
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from app.flow import server
from tests.project import ROOT, until

SECONDS = 90.0  # that any wait may last


def ask(url: str, path: str, content: dict | None = None):
    """GET, or POST of `content`, as JSON."""
    data = None if content is None else json.dumps(content).encode()
    request = urllib.request.Request(
        f"{url}{path}", data, {"Content-Type": "application/json"} if data else {}
    )
    with urllib.request.urlopen(request, timeout=SECONDS) as answer:
        return json.load(answer)


@contextmanager
def serving(
    root: Path, environment: Mapping[str, str] = os.environ
) -> Iterator[tuple[str, subprocess.Popen]]:
    """`sling ui` in a process, until SIGINT; what it says goes to root/said."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = str(listener.getsockname()[1])
    with (root / "said").open("w") as message:
        process = subprocess.Popen(
            [sys.executable, "-m", "app.cli", "ui", "--port", port],
            cwd=root,
            env={"PYTHONPATH": str(ROOT), **environment},
            stdout=message,
            stderr=message,
        )
    try:
        url = until(lambda: process.poll() is not None or server.address(root))
        assert isinstance(url, str), (root / "said").read_text()
        yield url, process
    finally:
        process.send_signal(signal.SIGINT)
        assert process.wait(SECONDS) == 0
    assert server.address(root) is None and not (root / ".prefect" / "port").exists()
