"""Runs of a test's script in processes of their own, forked from one that has imported it.

Python and what the script imports take seconds to start, the script itself hardly any.
"""

import importlib
import json
import os
import subprocess
import sys
import tempfile
import traceback
from types import SimpleNamespace

from tests.project import ROOT


class Forked:
    """`main()` of a module as a command, as often as called, until the end of the block.

    Args:
        module: What `python -m` would run.
        preload: Further modules that it may import later.
    """

    def __init__(self, module: str, *preload: str) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-m", "tests.forked", module, *preload],
            cwd=ROOT,
            env={**os.environ, "OMP_NUM_THREADS": "1"},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def __call__(self, *arguments: str) -> SimpleNamespace:
        """Run it: `returncode`, negative for a signal, and `message`, all that it printed."""
        print(json.dumps(arguments), file=self._process.stdin, flush=True)
        return SimpleNamespace(**json.loads(self._process.stdout.readline()))

    def __enter__(self) -> "Forked":
        return self

    def __exit__(self, *_: object) -> None:
        self._process.stdin.close()
        self._process.wait(30)
        self._process.stdout.close()


def _child(module, arguments: list[str], message: int) -> None:
    """In the forked process, which does not return."""
    os.dup2(message, 1), os.dup2(message, 2)
    sys.argv = [module.__file__, *arguments]
    status = 1
    try:
        module.main()
        status = 0
    except BaseException:
        traceback.print_exc()
    sys.stdout.flush(), sys.stderr.flush()
    os._exit(status)


def main() -> None:
    module, *_ = map(importlib.import_module, sys.argv[1:])
    for line in sys.stdin:
        with tempfile.TemporaryFile("w+") as message:
            child = os.fork()
            if not child:
                _child(module, json.loads(line), message.fileno())
            status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
            message.seek(0)
            print(json.dumps({"returncode": status, "message": message.read()}), flush=True)


if __name__ == "__main__":
    main()
