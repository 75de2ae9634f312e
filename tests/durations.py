"""A pytest plugin: lists the tests that take more than three seconds of CPU time.

`make durations` loads it. Set-up of fixtures is not counted, a test's own subprocesses are. It
reports and fails nothing: such a test is marked `slow`, or better made faster.
"""

import resource

import pytest

LIMIT_S = 3.0
PROPERTY = "cpu_seconds"
found: list[tuple[float, str]] = []


def cpu_seconds() -> float:
    """User and system time of this process and of its finished children [s]."""
    own = resource.getrusage(resource.RUSAGE_SELF)
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return own.ru_utime + own.ru_stime + children.ru_utime + children.ru_stime


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item):
    began = cpu_seconds()
    try:
        return (yield)
    finally:
        item.user_properties.append((PROPERTY, cpu_seconds() - began))


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    seconds = dict(report.user_properties).get(PROPERTY, 0.0)
    if report.when == "call" and seconds > LIMIT_S:
        found.append((seconds, report.nodeid))


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    terminalreporter.section(f"{len(found)} tests take more than {LIMIT_S:g} CPU-s")
    for seconds, name in sorted(found, reverse=True):
        terminalreporter.write_line(f"{seconds:8.1f} s  {name}")
