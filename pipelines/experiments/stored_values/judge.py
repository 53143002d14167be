"""One voyage through convert and ingest, and what became of it."""

from __future__ import annotations

import logging
import math
import shutil
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl

from pipelines.experiments.stored_values import instruments, motion, recorders
from pipelines.experiments.stored_values.changes import CHANGES, Change
from pipelines.experiments.stored_values.instruments import Instruments, Recorded
from pipelines.experiments.stored_values.motion import Motion
from pipelines.experiments.stored_values.recorders import Recorder
from shiplog.commands.convert import convert
from shiplog.exceptions import ShiplogError
from shiplog.ship_profile import file as profile_file
from shiplog.voyages.ingest.ingest import ingest

UNUSABLE = 1 | 2 | 4 | 8 | 32  # the contract's marks: gap, blank, limits, spike, frozen
WRONG_SHARE = 0.01  # of the usable rows: more than so many beyond the tolerance are wrong values
USABLE_SHARE = 0.5  # of the voyage: less, without a word, is lost
STATE = ("x0", "y0", "heading", "surge", "sway", "yaw_rate")


@dataclass(frozen=True)
class Draw:
    """What a voyage of one seed is."""

    seed: int
    motion: Motion
    kit: Instruments
    hz: float
    recorder: Recorder
    change: Change | None
    seen: Recorded
    how: dict


@dataclass(frozen=True)
class Outcome:
    """right     the stored values are the motion's
    named     a finding or a refusal names what was changed
    findings  every one, as "kind channel: sentence"
    wrong     column: share of usable rows beyond the tolerance, and the largest error
    """

    seed: int
    ship: str
    instruments: str
    hz: float
    recorder: str
    change: str
    family: str
    seen_by: str
    right: bool
    named: bool
    usable_share: float
    findings: tuple[str, ...]
    wrong: tuple[str, ...]

    @property
    def wrong_and_unsaid(self) -> bool:
        return not self.right and not self.named

    @property
    def wrongly_alarmed(self) -> bool:
        return not self.change and bool(self.findings)


def draw(seed: int, sound: float = 0.35) -> Draw:
    """A voyage by its seed; `sound` is the share of voyages in which nothing is changed."""
    rng = np.random.default_rng(seed)
    whole = rng.uniform() < sound
    kinds = list(motion.KINDS.values())
    if whole:
        kinds += list(motion.AT_REST.values())
    sailed = motion.sail(kinds[rng.integers(len(kinds))], rng)
    kit = list(instruments.SETS.values())[rng.integers(len(instruments.SETS))]
    seen, hz = instruments.recorded(sailed, kit, rng)
    every = [r for r in recorders.RECORDERS.values() if hz <= r.most_hz]
    recorder = every[rng.integers(len(every))]
    how: dict = {}
    change = None
    if not whole:
        fitting = [c for c in CHANGES if c.fits(sailed, seen, recorder.name)]
        change = fitting[rng.integers(len(fitting))]
        change.act(seen, how, sailed, rng)
    return Draw(seed, sailed, kit, hz, recorder, change, seen, how)


def outcome_of(seed: int) -> Outcome:
    logging.disable(logging.WARNING)
    return judged(draw(seed))


def judged(one: Draw) -> Outcome:
    folder = Path(tempfile.mkdtemp(prefix="stored_"))
    try:
        tables, findings = _through(one, folder)
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    wrong, usable = [], 0
    for table in tables:
        ok = (table["quality"].to_numpy() & UNUSABLE) == 0
        usable += int(ok.sum())
        wrong += _wrong(one, table, ok)
    share = usable * 0.1 / one.motion.kind.seconds
    named = bool(one.change) and any(_names(one.change, text) for text in findings)
    lost = share < USABLE_SHARE and not findings
    change = one.change
    return Outcome(
        one.seed, one.motion.kind.name, one.kit.name, one.hz, one.recorder.name,
        change.name if change else "", change.family if change else "",
        change.seen_by if change else "", not wrong and not lost, named, round(share, 3),
        tuple(findings), tuple(wrong),
    )  # fmt: skip


def _names(change: Change, finding: str) -> bool:
    text = finding.lower()
    return any(word in text for word in change.words)


def _through(one: Draw, folder: Path) -> tuple[list[pl.DataFrame], list[str]]:
    """The stored tables, and every sentence that was said."""
    content = recorders.profile(one.motion, one.seen, one.recorder)
    if unit := one.how.get("time unit"):
        content["table"]["time"]["unit"] = unit
    source = one.recorder.write(folder, one.seen, one.how)
    said: list[str] = []
    try:
        profile = profile_file.parse(recorders.as_text(content), "profile")
        logs = [source]
        if source.suffix != ".mcap":
            done = convert([source], profile, folder / "logs")
            said += [f"refused: {why}" for why in done.refused.values()]
            said += [f"lost: {what}" for what in done.lost.values()]
            logs = done.logs
    except ShiplogError as error:
        return [], [f"refused: {error}"]
    tables = []
    for path in logs:
        try:
            voyage = ingest(path, profile)
        except ShiplogError as error:
            said.append(f"refused: {error}")
            continue
        said += [f"{f.kind} {f.channel}: {f.sentence}" for f in voyage.report.findings]
        tables.append(voyage.table)
    return tables, said


def _wrong(one: Draw, table: pl.DataFrame, ok: np.ndarray) -> list[str]:
    """Columns of which more than `WRONG_SHARE` of the usable rows is not what the ship did."""
    at = table["time"].dt.epoch("ns").to_numpy() * 1e-9 - one.motion.unix
    if one.how.get("relative"):
        at = at - at[0] + _began(one, table)
    found = []
    names = {
        **{name: name for name in STATE}, "rudder": "rudder", "rps": "shaft",
        "wind_speed": "wind_speed", "wind_angle": "wind_angle",
    }  # fmt: skip
    for column, truth in names.items():
        if column not in table.columns:
            continue
        value = table[column].cast(pl.Float64).fill_null(np.nan).to_numpy()
        off = value - one.motion.at(truth, at)
        if column in ("heading", "wind_angle"):
            off = np.angle(np.exp(1j * off))
        inside = ok & (at >= 0.0) & (at <= one.motion.t[-1])
        off = np.abs(off[inside])
        most = tolerance(one, column, truth)
        share = float(np.mean(~(off <= most))) if len(off) else 0.0
        if share > WRONG_SHARE or (ok & ~inside).sum() > 50:
            worst = float(np.nanmax(off)) if len(off) and np.isfinite(off).any() else math.nan
            found.append(f"{column}: {100 * share:.0f} % of {len(off)} rows, up to {worst:.3g}")
    return found


def _began(one: Draw, table: pl.DataFrame) -> float:
    """Where in the voyage a table without a date begins: where its positions are nearest."""
    x, y = table["x0"].to_numpy(), table["y0"].to_numpy()
    good = np.flatnonzero(np.isfinite(x) & np.isfinite(y))
    if not len(good):
        return 0.0
    near = np.hypot(one.motion.x0 - x[good[0]], one.motion.y0 - y[good[0]])
    return float(one.motion.t[int(np.argmin(near))]) - 0.1 * float(good[0])


def tolerance(one: Draw, column: str, truth: str) -> float:
    """Six standard deviations of the instrument, two of its steps, and what a straight line between
    two samples can miss."""
    kit, step, degree = one.kit, one.kit.steps, math.pi / 180.0
    heading = 6.0 * kit.heading * degree + 2.0 * step.get("heading", 0.0) * degree + 1e-4
    speed = float(np.abs(one.motion.surge).max() + np.abs(one.motion.sway).max())
    size = {
        "x0": 6.0 * kit.position + 0.3, "y0": 6.0 * kit.position + 0.3,
        "heading": heading,
        "surge": 6.0 * kit.speed + 2.0 * step.get("sog", 0.0) + 0.5 * speed * heading + 0.01,
        "sway": 6.0 * kit.speed + speed * (heading + 2.0 * step.get("cog", 0.0) * degree) + 0.02,
        "rudder": 0.01 + 2.0 * step.get("rudder", 0.0) * degree, "rps": 0.06,
        "wind_speed": 1.2, "wind_angle": 0.25,
    }  # fmt: skip
    if column == "yaw_rate":
        gyro = kit.yaw_rate is not None
        own = 6.0 * kit.yaw_rate * degree if kit.yaw_rate else 1.5 * heading * one.hz
        return own + (1.0 if gyro else 3.0) * _bend(one, truth)
    if column == "wind_angle":  # of a light apparent wind the direction is loose
        least = float(one.motion.wind_speed.min())
        return size[column] + 1.2 / max(least, 0.3)
    return size[column] + _bend(one, truth)


def _bend(one: Draw, truth: str) -> float:
    """What a straight line over one period can be off at most, from the fine motion."""
    every = max(round(motion.FINE_HZ / one.hz), 2)
    value = (
        np.unwrap(getattr(one.motion, truth))
        if truth == "wind_angle"
        else getattr(one.motion, truth)
    )
    half = every // 2
    middle = value[half : len(value) - half]
    line = 0.5 * (value[: len(value) - 2 * half] + value[2 * half :])
    return 1.2 * float(np.abs(middle - line).max())
