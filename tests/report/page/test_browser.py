"""The page in a headless browser without a network: no error, no request, a replay that moves.

The page's own content security policy stays in force; what it blocks counts as a failure.
"""

import base64
import html
import io
import json
import re
import shutil
import subprocess
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from pipeline.report.page import write_page
from pipeline.report.report import Report
from pipeline.report.run import write_run
from pipeline.report.styles import styles
from tests.report.conftest import BAND, METHOD
from tests.report.toy_replay import toy_replay

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
BROWSER = next(filter(None, map(shutil.which, NAMES)), None)
FLAGS = (
    "--headless", "--no-sandbox", "--disable-gpu", "--use-gl=angle", "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader", "--disable-quic", "--no-first-run", "--disable-extensions",
    "--disable-background-networking", "--disable-component-update", "--disable-sync",
    "--host-resolver-rules=MAP * ~NOTFOUND", "--window-size=1200,900",
    "--virtual-time-budget=60000",
)  # fmt: skip
# What goes wrong from the first line on; then a visitor's way through the replay.
LISTEN = """<script>
window.failures = [];
addEventListener("error", (event) => failures.push(String(event.message || event.target)), true);
addEventListener("unhandledrejection", (event) => failures.push(String(event.reason)));
addEventListener("securitypolicyviolation", (event) => failures.push(event.blockedURI));
console.error = (...words) => failures.push(words.join(" "));
</script>"""
VISIT = """<script>
addEventListener("load", async () => {
  const find = (id) => document.getElementById(id);
  const plot = find("plot"), wait = (ms) => new Promise((done) => setTimeout(done, ms));
  const state = async () => ({
    frame: Number(find("frame").value), time: find("time").textContent,
    cloud: plot.data[1].z.slice(), line: plot.data[2].y.slice(),
    visible: plot.data.map((one) => one.visible !== false), traces: plot.data.length,
    image: await Plotly.toImage(plot, { format: "png", width: 480, height: 360 }),
  });
  const act = async (id, kind, value) => {
    if (value !== undefined) find(id).value = value;
    find(id).dispatchEvent(new Event(kind));
    await wait(500);
    return state();
  };
  const seen = {};
  try {
    await wait(500);
    seen.start = await state();
    seen.slid = await act("frame", "input", 5);
    find("play").click();
    await wait(2000);
    find("play").click();
    seen.played = await state();
    find("recoil").click();
    await wait(500);
    seen.recoil = await state();
    document.querySelector("#methods input").click();
    await wait(500);
    seen.hidden = await state();
    seen.other = await act("band", "change", 1);
  } catch (error) { failures.push(String(error)); }
  seen.run = find("run").textContent;
  seen.requests = performance.getEntriesByType("resource").map((one) => one.name)
    .filter((name) => !name.startsWith("data:") && !name.startsWith("blob:"));
  seen.failures = [...failures];
  const foreign = new Image();  // is a request noticed at all?
  foreign.src = "http://example.invalid/picture.png";
  await wait(500);
  seen.noticed = failures.length - seen.failures.length;
  const note = document.createElement("pre");
  note.id = "probe";
  note.textContent = JSON.stringify(seen);
  document.body.append(note);
});
</script>"""

if BROWSER is None:
    pytest.skip(f"no browser: none of {', '.join(NAMES)}", allow_module_level=True)


@pytest.fixture
def pages(root, params, results):
    """Two bands, the second with a band half a metre further; the first with two methods."""
    one = toy_replay(None, BAND, METHOD, results.episodes[BAND], {})
    moving = one.center_line + np.linspace(0, 0.3, 90)[:, None, None] * [0, 1, 0]
    one = replace(one, center_line=moving)
    far = replace(one, center_line=one.center_line + [0, 0.5, 0])
    results.episodes["far"] = results.episodes[BAND]
    results.episodes[BAND] = replace(
        results.episodes[BAND],
        clouds=[
            cloud - np.float32([0, 0, 0.002 * frame])
            for frame, cloud in enumerate(results.episodes[BAND].clouds)
        ],
    )
    replays = {BAND: {METHOD: one, "de": one}, "far": {METHOD: far}}
    report = Report(params, results, replays, styles([METHOD, "de"]), root)
    write_page(report, "# Report\n\n## In short\n")
    write_run(report.folder, runs="a test")
    return report.folder / "index.html", one, far


def visited(page, tmp_path) -> dict:
    text = page.read_text("utf-8")
    probed = page.with_name("probed.html")  # beside run.js
    text = text.replace("<head>", f"<head>{LISTEN}", 1)
    probed.write_text(text.replace("</body>", f"{VISIT}</body>"), "utf-8")
    profile = tmp_path / "profile"
    done = subprocess.run(
        [BROWSER, *FLAGS, f"--user-data-dir={profile}", "--dump-dom", probed.as_uri()],
        capture_output=True, text=True, timeout=180,
    )  # fmt: skip
    found = re.search(r'<pre id="probe">(.*?)</pre>', done.stdout, re.DOTALL)
    assert found, f"the probe did not end:\n{done.stderr[-2000:]}"
    return json.loads(html.unescape(found[1]))


def pixels(seen: dict) -> np.ndarray:
    """Of the replay's picture, shape (H, W, 3)."""
    picture = base64.b64decode(seen["image"].partition(",")[2])
    return np.asarray(Image.open(io.BytesIO(picture)).convert("RGB"), int)


def coloured(seen: dict, color: str) -> int:
    """How many pixels are of a colour."""
    wanted = [int(color[i : i + 2], 16) for i in (1, 3, 5)]
    return int((np.abs(pixels(seen) - wanted).max(axis=2) < 40).sum())


def test_the_replay_runs_alone_and_without_an_error(pages, tmp_path) -> None:
    page, one, far = pages
    seen = visited(page, tmp_path)
    assert seen["failures"] == [] and seen["requests"] == [] and seen["noticed"] > 0
    assert seen["run"].startswith("This run. written: ") and "runs: a test" in seen["run"]

    named = styles([METHOD, "de"])
    start, slid = seen["start"], seen["slid"]
    assert start["traces"] == 4 and slid["frame"] == 5 and "frame 6/90" in slid["time"]
    assert "−7.500 s" in slid["time"]  # released at 8 s
    for state in (start, slid):
        np.testing.assert_allclose(state["line"], one.center_line[state["frame"], :, 1], atol=6e-4)
        np.testing.assert_allclose(state["cloud"], -0.002 * state["frame"], atol=6e-4)
    assert np.ptp(pixels(slid), axis=(0, 1)).max() > 100  # something is drawn
    assert coloured(slid, "#222222") > 20
    assert (pixels(start) != pixels(slid)).any()

    assert slid["frame"] < seen["played"]["frame"] < 89
    assert seen["recoil"]["frame"] == 80
    assert coloured(seen["recoil"], named["de"].color) > 50
    assert seen["recoil"]["visible"] == [True] * 4
    assert seen["hidden"]["visible"] == [True, True, False, True]
    other = seen["other"]
    assert other["traces"] == 3
    np.testing.assert_allclose(other["line"], far.center_line[other["frame"], :, 1], atol=6e-4)
    assert coloured(other, named[METHOD].color) > 50
