"""What every script begins and ends with: arguments, params.yaml, and an error with its remedy."""

from __future__ import annotations

import os
import signal
import sys
import time
from collections.abc import Callable
from pathlib import Path
from threading import Thread

from pipeline.params import Params, load
from sling2sim2real.base import errors
from sling2sim2real.base.errors import UserError
from sling2sim2real.base.layout import Layout, NotMade, owner
from sling2sim2real.settings import expect_known
from sling2sim2real.settings.identification import steps_of

MAKERS = {  # steps that make a folder of another name
    "raw": "record",
    "episodes": "episode",
    "launches": "evidence",
    "policies": "policy",
}

OF_A_SEARCH = ("history", "clusters", "evaluations", "confidence")  # its last step writes the rest

OF_DVC = "DVC_STAGE"  # in the environment of what DVC runs
OF_FLOW = "SLING_FLOW"  # process id of the `sling` command that started that DVC
OF_EXPERIMENT = "DVC_EXP_NAME"  # the same, of `dvc exp run`
GRACE = 5.0  # s from the interrupt to the end


def arguments(*names: str) -> list[str]:
    """Return as many arguments as `names` (band, method); else print the usage and exit with 2."""
    given = sys.argv[1:]
    if len(given) != len(names) or any(argument.startswith("-") for argument in given):
        script = f"stages.{Path(sys.argv[0]).stem}"
        print(" ".join(["usage: python -m", script, *map(str.upper, names)]), file=sys.stderr)
        sys.exit(2)
    return given


def started(*names: str) -> tuple[Params, *tuple[str, ...]]:
    """params.yaml and the stage's arguments, each of which it must know. Raises UserError.

    Where `dvc exp run -S` has written what is refused, the error says how to take it back.
    """
    given = arguments(*names)
    try:
        params = load()
    except UserError as error:
        if OF_EXPERIMENT in os.environ and Path.cwd() == Path(os.environ["DVC_ROOT"]):
            raise UserError(
                f"{error}; DVC wrote it there: `sling reset KEY` takes it back, and"
                " `dvc exp run --temp` leaves params.yaml alone"
            ) from error
        raise
    for name, value in zip(names, given, strict=True):
        expect_known(params, name, value)
    return params, *given


def run(main: Callable[[], int | None]) -> None:
    """Run a stage or a command: a mistake is one line, which says what makes a missing file."""

    def explained() -> int | None:
        try:
            return main()
        except NotMade as error:
            raise UserError("; ".join(filter(None, (str(error), remedy(error))))) from error

    if OF_DVC in os.environ:
        Thread(target=_end_with_dvc, daemon=True).start()
    errors.run(explained)


def _end_with_dvc() -> None:
    """A stage whose DVC or flow was killed would write beside the one that DVC starts next."""
    import psutil

    flow = int(os.environ.get(OF_FLOW) or os.getpid())
    try:
        outermost = psutil.Process()  # or the shell around us, if it stays
        while (dvc := outermost.parent()) and OF_DVC in dvc.environ():
            outermost = dvc
        while (dvc is None or outermost.ppid() == dvc.pid) and psutil.pid_exists(flow):
            time.sleep(0.5)
    except psutil.AccessDenied:
        return
    except psutil.NoSuchProcess:  # the shell was killed too
        pass
    os.kill(os.getpid(), signal.SIGINT)
    time.sleep(GRACE)
    os._exit(130)


def remedy(error: NotMade) -> str:
    """Describe how a user gets a file, or gets it anew; "" where no stage makes it."""
    owner_of_path = owner(error.path)
    if owner_of_path is None:
        return ""
    folder, band, method = owner_of_path
    if folder == "raw" and band not in (*load().run.rig, *load().run.dips):
        return f"`sling add-recording --band {band} FILE.mcap` puts a recording there"
    params = load()
    step = MAKERS.get(folder, folder)
    if folder in OF_A_SEARCH and method in params.methods:
        steps = steps_of(params.methods[method].search)
        step = folder if folder in steps else steps[-1]
    elif error.path.name == "launches.parquet":
        step = "launches"
    stage = stage_of(params, step, band, method)
    if stage is None:
        what = f"{method} under run.methods or run.ablations" if method else f"{band} under run.own"
        return f"name {what} in params.yaml, then `dvc repro` makes it"
    if error.problem != "missing":
        return f"`dvc repro --force {stage}` makes it anew"
    return f"`dvc repro {stage}` makes it"


def stage_of(params: Params, step: str, band: str, method: str | None = None) -> str | None:
    """The stage of a step for a band, and a method; None where `run` lets them not meet."""
    requested = params.run
    item = band if method is None else f"{band}-{method}"
    for group, bands, methods in (
        ("", requested.bands, requested.methods),
        ("own_", requested.own, requested.methods[:1]),
        ("dip_", requested.dips, requested.methods[:1]),
        ("ablation_", requested.ablations.bands, requested.ablations.methods),
    ):
        if band in bands and method in (None, *methods):
            return f"{group}{step}@{item}"
    return None


def ungrouped(step: str) -> str:
    """The step of a stage's, without what stage_of puts before it."""
    return step.removeprefix("ablation_").removeprefix("own_").removeprefix("dip_")


def unmounted(params: Params, band: str, root: str | Path = ".") -> list[str]:
    """A warning where nothing is known of how a band hangs: simulations go on without."""
    path = Layout(Path(root)).clamps(band)
    if path.exists():
        return []
    stage = stage_of(params, "clamps", band)
    mended = f"; `dvc repro {stage}` fits it to a recording" if stage else ""
    return [f"{path} is missing, so the band hangs as `setup` says{mended}"]
