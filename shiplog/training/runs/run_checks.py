"""What is refused of runs before the work: other ships, windows or settings, and none to go on
with."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Sized
from pathlib import Path

import polars as pl

from shiplog.exceptions import ProfileError, RunError, WindowError, listed
from shiplog.ship_profile.differences import differences
from shiplog.ship_profile.profile import Profile
from shiplog.training.runs.run_folder import RunFolder
from shiplog.training.settings.run_config import Config
from shiplog.voyages.store import contradicted
from shiplog.voyages.store.contradicted import Contradicted
from shiplog.voyages.store.store import Store


def refuse_other_ship(run: RunFolder, profile: Profile) -> None:
    """Raises RunError where the voyages to diagnose are of another ship than the run."""
    if profile.columns != run.profile.columns or profile.ship.name != run.profile.ship.name:
        raise RunError(
            f"{run.name} is of {run.profile.ship.name!r} with {listed(run.profile.columns)}; the "
            f"voyages are of {profile.ship.name!r} with {listed(profile.columns)}.",
            hint="diagnose a ship with a model of its own.",
        )
    refuse_other_profile(run, profile, "the voyages")


def refuse_other_profile(run: RunFolder, profile: Profile, other: str) -> None:
    """Raises RunError where `other`, a run or voyages, has another profile of the ship: other
    sizes, places, lever arms or kinds of sensors."""
    if differ := differences(run.profile, profile):
        raise RunError(
            f"{run.name} and {other} are of two profiles of {run.profile.ship.name!r}, which "
            f"differ in {listed(differ)}.",
            hint="ingest the logs again with the profile of the run, or train a run with theirs.",
        )


def refuse_other_columns(run: RunFolder, columns: tuple[str, ...], other: str) -> None:
    """Raises RunError where `other`, a run or voyages, has other actuators or sensors."""
    if run.profile.columns != columns:
        mine, theirs = set(run.profile.columns), set(columns)
        raise RunError(
            f"{run.name} is of a ship with {listed(mine - theirs) if mine - theirs else 'the same'}"
            f" columns and {other} with {listed(theirs - mine)} instead.",
            hint="choose voyages and runs of one ship.",
        )


def refuse_other_window(first: RunFolder, other: RunFolder) -> None:
    """Raises RunError where two runs to compare have windows of different lengths."""
    if other.config.window != first.config.window:
        raise RunError(
            f"{first.name} has windows of {first.config.window} s, {other.name} of "
            f"{other.config.window} s.",
            hint="compare runs with the same window.",
        )


def refuse_no_window(run: RunFolder, names: Sequence[str], planned: Sized) -> None:
    """Raises WindowError where no window of a run was planned in these voyages."""
    if not len(planned):
        size = run.config.window
        raise WindowError(
            f"{run.name} has windows of {size} s, and there are no {size} s without a gap in "
            f"{listed(names, most=8)}.",
            hint="choose longer voyages with --voyages, or train a run with a shorter --window.",
        )


def refuse_other_settings(run: RunFolder, config: Config) -> None:
    """Raises RunError where a finished run has other settings than these."""
    if run.config != config:
        raise RunError(
            f"{run.path} is a finished run of other settings.",
            hint="choose another --out, or remove that folder.",
        )


def refuse_other_rows(run: RunFolder, store: Store) -> None:
    """Raises RunError where the store has other rows of a finished run's voyages than it was
    trained on: their logs were ingested anew, corrected, or by another program."""
    rows = store.seconds(run.trained_on, store.profile(run.trained_on))
    split = run.config.split
    for kept, names in ((run.training(), split.training), (run.validation(), split.validation)):
        if not kept.equals(rows.filter(pl.col("voyage").is_in(names))):
            raise RunError(
                f"{run.path} is a finished run of other data: the voyages of {store.path} were "
                "ingested anew since.",
                hint="choose another --out, or remove that folder.",
            )


def refuse_extended(path: Path) -> None:
    """Raises RunError for a run folder that a diagnosis made, which no training repeats."""
    if (path / "extension.json").is_file():
        raise RunError(
            f"The run {path} was extended by a diagnosis, and not trained.",
            hint="repeat the run that it extends, and diagnose again.",
        )


def refuse_sheet(path: Path) -> None:
    """Raises RunError for a run folder that was made from a trial sheet, and from no voyage."""
    if (path / "trial_sheet.toml").is_file():
        raise RunError(
            f"The run {path} is from a trial sheet, and from no voyage.",
            hint=f"repeat it with --trial-sheet {path / 'trial_sheet.toml'}.",
        )


def refuse_unended(failures: Mapping[str, str], count: int) -> None:
    """Raises RunError where some of `count` trainings failed. `failures`: name → why."""
    if failures:
        line = "; ".join(f"{name}: {why}" for name, why in failures.items())
        raise RunError(
            f"{len(failures)} of {count} trainings did not end: {line}.",
            hint="give the same command again: finished seeds and checkpoints are kept.",
        )


def refuse_none_trained(finished: Sized, failures: Mapping[str, str]) -> None:
    """Raises RunError where no window set of the paper's experiment is finished."""
    if not finished:
        reasons = "; ".join(f"{name}: {why}" for name, why in failures.items())
        raise RunError(
            f"No set could be trained: {reasons}.",
            hint="mend that and give the same command again.",
        )


def refuse_contradicted(found: Sequence[Contradicted], unchecked: bool) -> str:
    """The warning with which a training on contradictory voyages begins; empty where there are
    none. Raises ProfileError for them, unless `unchecked`.

    found   contradictions of the voyages that it uses
    """
    if not found:
        return ""
    if not unchecked:
        raise ProfileError(
            contradicted.text(found),
            hint="correct the profile and ingest these logs again, leave these voyages out with "
            "--voyages, or train on them as they are with --unchecked.",
        )
    return f"Trained although sensors contradict each other. {contradicted.text(found)}"
