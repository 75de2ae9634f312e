"""Processes beside this one, for what keeps one core busy: they end with it, whatever ends it."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context, parent_process
from threading import Thread
from typing import Any, TypeVar

from sling2sim2real.base.errors import UserError
from sling2sim2real.base.machine import cores

Result = TypeVar("Result")


class Pool(ProcessPoolExecutor):
    """Fresh interpreters, as many as a stage has cores; a context, which ends them."""

    def __init__(
        self, begin: Callable[..., None] | None = None, *arguments: Any, workers: int | None = None
    ):
        """Start them once there is work.

        Args:
            begin: Called with `arguments` in each of them first.
            workers: How many instead.
        """
        self.workers = workers or cores()
        super().__init__(
            self.workers, get_context("spawn"), initializer=_begin, initargs=(begin, arguments)
        )

    def map(
        self,
        fn: Callable[..., Result],
        *iterables: Iterable[Any],
        timeout: float | None = None,
        chunksize: int = 1,
    ) -> Iterator[Result]:
        """Results in order. Raises UserError where one of the processes was killed."""
        try:
            yield from super().map(fn, *iterables, timeout=timeout, chunksize=chunksize)
        except BrokenProcessPool as error:
            raise UserError(
                "a worker process was killed, perhaps for want of memory; run it again, with fewer"
                f" than {self.workers} at a time by SLING_WORKERS"
            ) from error


def _begin(begin: Callable[..., None] | None, arguments: tuple) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the one that waits for us
    Thread(target=_end_with_parent, daemon=True).start()
    if begin:
        begin(*arguments)


def _end_with_parent() -> None:
    """A worker whose pool was killed would wait for work for ever."""
    if parent := parent_process():
        parent.join()
    os._exit(1)
