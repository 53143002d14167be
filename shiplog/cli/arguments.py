"""What a command line asks for, found before anything heavy is loaded."""

from __future__ import annotations

from pathlib import Path

from shiplog.exceptions import ShiplogError


def sample_logs(given: Path | None = None) -> Path:
    """The folder of logs for the demo: the one given, or that of the checkout this runs from.
    Raises ShiplogError."""
    if given is not None:
        if not any(given.glob("*.mcap")):
            raise ShiplogError(f"No log in {given}.", hint="give --logs a folder of MCAP logs.")
        return given
    here = (Path.cwd(), Path(__file__).resolve().parents[2])
    for folder in here:
        if any((folder / "sample_logs").glob("*.mcap")):
            return folder / "sample_logs"
    raise ShiplogError(
        f"There is no folder sample_logs in {here[0]}.",
        hint="run the demo from a clone of shiplog, or make the logs again with "
        "`python -m pipelines.experiments.simulated_ship sample_logs` and give them with --logs.",
    )
