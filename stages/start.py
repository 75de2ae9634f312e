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
from pipeline.params.run import Pair, Recording
from sling2sim2real.base import errors
from sling2sim2real.base.errors import UserError
from sling2sim2real.base.files import NotMade

OF_DVC = "DVC_STAGE"  # in the environment of what DVC runs
OF_FLOW = "SLING_FLOW"  # process id of the `sling` command that started that DVC
OF_EXPERIMENT = "DVC_EXP_NAME"  # the same, of `dvc exp run`
GRACE = 5.0  # s from the interrupt to the end


def arguments(*names: str) -> list[str]:
    """Return as many arguments as `names`; else print the usage and exit with 2."""
    given = sys.argv[1:]
    if len(given) != len(names) or any(argument.startswith("-") for argument in given):
        script = f"stages.{Path(sys.argv[0]).stem}"
        print(" ".join(["usage: python -m", script, *map(str.upper, names)]), file=sys.stderr)
        sys.exit(2)
    return given


def parameters() -> Params:
    """params.yaml. Raises UserError.

    Where `dvc exp run -S` has written what is refused, the error says how to take it back.
    """
    try:
        return load()
    except UserError as error:
        if OF_EXPERIMENT in os.environ and Path.cwd() == Path(os.environ["DVC_ROOT"]):
            raise UserError(
                f"{error}; DVC wrote it there: `git checkout params.yaml` takes it back, and"
                " `dvc exp run --temp` leaves params.yaml alone"
            ) from error
        raise


def recording_of_stage() -> tuple[Params, Recording]:
    """params.yaml, and the recording that the stage's argument names. Raises UserError."""
    (name,) = arguments("recording")
    params = parameters()
    return params, known(params.run.recordings, name, "run.recordings")


def pair_of_stage() -> tuple[Params, Pair]:
    """params.yaml, and the pair that the stage's argument names. Raises UserError."""
    (name,) = arguments("recording-method")
    params = parameters()
    return params, known(params.run.pairs, name, "run.pairs")


def known(entries: dict, name: str, where: str):
    """The entry of that name. Raises UserError, which says where in params.yaml it was sought."""
    if name not in entries:
        raise UserError(f"{name}: not under {where} in params.yaml, which has {', '.join(entries)}")
    return entries[name]


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
    """Describe how a user gets a file of data/, or gets it anew; "" of any other file."""
    if "data" not in error.path.parts[:-1]:
        return ""
    if "launches" in error.path.parts:
        return "a CSV with the header draw_y,draw_z,error,landing,use will do"
    yours = "; of a band of yours, put MCAP files there" if "raw" in error.path.parts else ""
    return f"`dvc repro` makes it{' anew' * (error.problem != 'missing')}{yours}"
