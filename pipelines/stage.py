"""What a stage does with a fault of its input."""

from __future__ import annotations

import logging
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from shiplog.exceptions import ShiplogError


@contextmanager
def stage() -> Iterator[None]:
    """A fault of the input is one sentence on stderr and exit code 1."""
    logging.basicConfig(format="%(message)s", level=logging.INFO)
    try:
        yield
    except ShiplogError as error:
        print(error, file=sys.stderr)
        sys.exit(error.exit_code)
