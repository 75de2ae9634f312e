"""A Prefect server that is killed while a stage runs."""

import psutil
import pytest

from tests.app.flow.test_server import flow, listens
from tests.project import until

__all__ = ["flow"]  # a fixture


@pytest.mark.validation
def test_a_server_that_is_gone_keeps_no_stage(flow) -> None:
    url = flow.stdout.readline().strip()
    for one in psutil.Process(flow.pid).children(recursive=True):  # the guard and the server
        one.kill()
    until(lambda: not listens(url))
    flow.stdin.write("\n")
    flow.stdin.flush()
    assert float(flow.stdout.readline()) < 30  # s: the task's code ended, without an error
