"""What the decision that is being replaced says of the same trial, with the same model.

python -m pipelines.hidden_effects.former BASE --store STORE --voyages 'trial_*' --json FILE

The file is a verdict as `shiplog diagnose --json` writes it, with `decision` in addition: `former`,
or `only` where this source holds one decision and there is no other to ask.
"""

from __future__ import annotations

import argparse
import inspect
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from pipelines.diagnose import diagnose_run
from shiplog import runs
from shiplog.exceptions import ShiplogError
from shiplog.store import Store


def answer(
    base: Path, store: Store, voyages: Sequence[str], diagnose: Callable[..., Any] = diagnose_run
) -> dict[str, Any]:
    """The verdict as JSON. Raises ShiplogError."""
    two = "former" in inspect.signature(diagnose).parameters
    with tempfile.TemporaryDirectory() as folder:  # report and pictures are not wanted
        more = {"former": True} if two else {}
        done = diagnose(base, store, voyages, Path(folder) / "d", **more)
        return done.verdict.as_json() | {"decision": "former" if two else "only"}


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m pipelines.hidden_effects.former",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("base", type=Path, help="a run made on the nominal voyages")
    parser.add_argument("--store", type=Path, required=True)
    parser.add_argument("--voyages", nargs="+", default=["trial_*"], help="of the trial")
    parser.add_argument("--json", type=Path, required=True, help="the file for the verdict")
    given = parser.parse_args(arguments)
    try:
        found = answer(given.base, Store(given.store), given.voyages)
    except ShiplogError as error:
        print(error, file=sys.stderr)
        return 1
    runs.write_json(given.json, found)
    return 0


if __name__ == "__main__":
    sys.exit(main())
