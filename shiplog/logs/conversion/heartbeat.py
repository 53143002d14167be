"""A line on stderr every two seconds while something long goes on."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

log = logging.getLogger(__name__)

EVERY_S = 2.0  # a person takes a longer silence for a program that hangs


@contextmanager
def saying(what: str, every_s: float = EVERY_S) -> Iterator[None]:
    """Say `what` and the time it has taken, every `every_s` seconds until the block ends.

    A thread says it, so that it needs no call from inside a library that reads or writes.
    """
    began = time.monotonic()
    done = threading.Event()

    def say() -> None:
        while not done.wait(every_s):
            log.info("%s: %.0f s", what, time.monotonic() - began)

    thread = threading.Thread(target=say, daemon=True)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()
