"""A headless Chromium, steered by the DevTools protocol, that looks at pages of this machine."""

from __future__ import annotations

import base64
import io
import itertools
import json
import re
import shutil
import subprocess
import tempfile
import time
from contextlib import ExitStack
from pathlib import Path

from PIL import Image
from websockets.sync.client import connect

from pipeline.base.errors import UserError

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
LISTENING = re.compile(r"DevTools listening on (ws://\S+)\s")
STARTED = 60.0  # s that it may take to listen
LOCAL = re.compile(r"(https?|wss?)://(127\.0\.0\.1|localhost)[:/]|data:|blob:|about:")


class Browser:
    """One page. To be used in a `with`."""

    def __init__(self, width: int = 1360, height: int = 1010) -> None:
        self.size, self._asked = (width, height), {}
        self._numbers, self._stack = itertools.count(1), ExitStack()

    def __enter__(self) -> Browser:
        program = next(filter(None, map(shutil.which, NAMES)), None)
        if program is None:
            raise UserError(f"no Chromium ({', '.join(NAMES)}); install one: apt install chromium")
        with ExitStack() as stack:  # a start that fails leaves nothing
            self._start(program, stack)
            self._stack = stack.pop_all()
        return self

    def _start(self, program: str, stack: ExitStack) -> None:
        folder = stack.enter_context(tempfile.TemporaryDirectory(ignore_cleanup_errors=True))
        width, height = self.size
        options = [
            "--headless=new", "--no-sandbox", "--disable-gpu", "--hide-scrollbars",
            "--disable-background-networking", "--disable-component-update", "--no-first-run",
            "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1", "--no-proxy-server",
            "--remote-debugging-port=0", f"--window-size={width},{height}",
            f"--user-data-dir={folder}",
        ]  # fmt: skip
        log = Path(folder, "log")  # not a pipe, which fills where nobody reads on
        with log.open("w") as written:
            process = subprocess.Popen([program, *options, "about:blank"], stderr=written)
        stack.callback(process.wait, 20)
        stack.callback(process.terminate)
        deadline = time.monotonic() + STARTED
        while not (match := LISTENING.search(log.read_text(errors="replace"))):
            if process.poll() is not None or time.monotonic() > deadline:
                raise UserError(f"{program} does not start")
            time.sleep(0.05)
        self._socket = stack.enter_context(
            connect(match[1], max_size=None, compression=None, proxy=None)
        )
        self._session = None
        target = self("Target.createTarget", url="about:blank")["targetId"]
        self._session = self("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        self("Page.enable"), self("Network.enable")
        metrics = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        self("Emulation.setDeviceMetricsOverride", **metrics)

    def __exit__(self, *error) -> None:
        self._stack.close()

    def __call__(self, method: str, **parameters) -> dict:
        """Call a method of the protocol, and note what the page asks for meanwhile."""
        number = next(self._numbers)
        message = {"id": number, "method": method, "params": parameters}
        if self._session:
            message["sessionId"] = self._session
        self._socket.send(json.dumps(message))
        while True:
            answer = json.loads(self._socket.recv(60))
            self._note(answer.get("method"), answer.get("params", {}))
            if answer.get("id") == number:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']['message']}")
                return answer["result"]

    def _note(self, event: str | None, about: dict) -> None:
        if event == "Network.requestWillBeSent" and not LOCAL.match(about["request"]["url"]):
            self._asked[about["requestId"]] = about["request"]["url"]
        elif event == "Network.loadingFailed" and about.get("blockedReason") == "csp":
            self._asked.pop(about["requestId"], None)  # the server has forbidden it

    @property
    def elsewhere(self) -> list[str]:
        """Addresses that a page asked for and that are not on this machine."""
        self.evaluate("0")  # what has happened since
        return sorted(set(self._asked.values()))

    def evaluate(self, script: str):
        """The value of a JavaScript expression in the page."""
        return self("Runtime.evaluate", expression=script, returnByValue=True)["result"].get(
            "value"
        )

    def open(self, url: str, *texts: str, settling: float = 2.0) -> None:
        """Open a page, wait for `texts`, and `settling` more [s] for what moves into its place."""
        self("Page.navigate", url=url)
        self.wait(*texts)
        time.sleep(settling)

    def wait(self, *texts: str, seconds: float = 30.0) -> None:
        """Wait until the page shows all of `texts`. Raises TimeoutError."""
        deadline = time.monotonic() + seconds
        while True:
            shown = self.evaluate("document.body ? document.body.innerText : ''") or ""
            missing = [text for text in texts if text not in shown]
            if not missing:
                break
            if time.monotonic() > deadline:
                raise TimeoutError(f"the page does not show {missing}, but: {shown[:2000]}")
            time.sleep(0.25)

    def shoot(self, path: Path, height: int | None = None) -> None:
        """Save what is seen, or its upper part, as PNG of 256 colours."""
        seen = self("Page.captureScreenshot", format="png")["data"]
        image = Image.open(io.BytesIO(base64.b64decode(seen))).convert("RGB")
        image = image.crop((0, 0, image.width, height or image.height))
        path.parent.mkdir(parents=True, exist_ok=True)
        image.quantize(256, method=Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE).save(
            path, optimize=True
        )
