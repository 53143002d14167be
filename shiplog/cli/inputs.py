"""What a command reads: there at all, before the work. Heavy imports are inside."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path


def check_paths(logs: Sequence[Path], profile: str | None) -> None:
    """Raises ShiplogError where there is no such profile, or none of the logs is there; one of
    several that is not there does not stop the others."""
    from shiplog.exceptions import LogUnreadable
    from shiplog.ship_profile import file as profiles

    if profile is not None:
        profiles.load(profile)
    if not any(log.exists() for log in logs):
        raise LogUnreadable(
            f"{logs[0]} does not exist.", hint="give the path of a log, or a folder of them."
        )


def check_voyages(store: Path, *patterns: Sequence[str] | None) -> None:
    """Raises StoreError for a store or voyage that is not there."""
    from shiplog.voyages.store.store import Store

    for chosen in patterns:
        Store(store).select(list(chosen or ()))


def check_runs(
    runs: Sequence[Path],
    store: Path,
    voyages: Sequence[str] | None,
    causes: Sequence[Path] | None,
) -> None:
    """Raises ShiplogError for a run, voyage or file that is not there."""
    from shiplog.machine.paths import check_causes, check_run, refuse_same_names

    for run in runs:
        check_run(run)
    refuse_same_names(runs)
    check_causes(causes or ())
    check_voyages(store, voyages)
