"""Faults of actuators, written into what measured voyages recorded.

What acted in these voyages is what they recorded, a. A fault f is written as an order x with
f(x) = a: the ship moved as it did, and its record claims more than acted. So no fault can be
written that the measured actuator contradicts, such as a slow rate where it jumps.

    limit      x is larger where a stands at its largest, l
    rate       x is at the end of each ramp when the ramp begins
    dead zone  x = a + d sign(a)
    backlash   x = a + b on the way up, a - b on the way down
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import polars as pl

from pipelines.experiments.findings.faults import Columns, Fault, written_table
from shiplog.commands.convert import convert
from shiplog.commands.prepare import expand, ingest_logs
from shiplog.exceptions import ShiplogError
from shiplog.ship_profile import file as profiles
from shiplog.voyages.store.store import Store

DEGREE = np.pi / 180.0
AT_STOP = 0.97  # of the limit: from there on a unit stands at its stop
MOVED = 1e-3  # of the largest value: what is less is no motion
NEUTRAL = 0.03  # of the largest value: what is less is no order, a pulse's neutral and its trim
STEADY = 0.15  # of the rate: how even a ramp is
SHORTEST = 4  # rows of a ramp
LEAST = 0.03  # share of the rows that a fault has to change, or it is none

BLUEBOAT, BLUEBOAT_UNIT = "blueboat_10hz.parquet", "thruster_port"
BLUEBOAT_TRIAL = ("00000222", "00000223", "00000228")  # none of them above 0.605 of full
BLUEBOAT_STOP, BLUEBOAT_ORDER = 0.605, 1.0
BLUEBOAT_DEAD = 0.09  # Blue Robotics: 36 of 400 μs
HSVA = "hsva_cpmc_zigzag_20hz_model.parquet"
HSVA_TRIAL = ("HSVA_CPMC_KVLCC2_Z_20_10_P", "HSVA_CPMC_KVLCC2_Z_20_10_S")
HSVA_STOP, HSVA_ORDER = 20.0 * DEGREE, 30.0 * DEGREE
HSVA_RATE = 0.28  # rad/s, of its ramps: 16 deg/s at the scale of 1 to 45.7
HSVA_PLAY = 3.0 * DEGREE


def beyond_stop(acted: np.ndarray, limit: float, order: float) -> np.ndarray:
    """The order where what acted stands at `limit`: `order`. A voyage that does not come there is
    left alone. Raises ShiplogError where it went farther."""
    if np.nanmax(np.abs(acted)) > limit * 1.01:
        raise ShiplogError(
            f"What acted reached {np.nanmax(np.abs(acted)):.3g}, beyond the limit of {limit:.3g}.",
            hint="choose voyages that stay below it, or a larger limit.",
        )
    at = np.abs(acted) >= AT_STOP * limit
    return np.where(at, np.copysign(order, acted), acted)


def before_ramps(acted: np.ndarray, time: np.ndarray, rate: float) -> np.ndarray:
    """Each ramp of that rate [1/s] as a step at its beginning."""
    slope = np.diff(acted) / np.diff(time)
    order = acted.copy()
    begin = 0
    for end in range(1, len(slope) + 1):
        ramp = _even(slope[begin], rate)
        same = end < len(slope) and slope[end] * slope[begin] > 0.0 and _even(slope[end], rate)
        if ramp and same:
            continue
        if ramp and end - begin >= SHORTEST:
            order[begin + 1 : end + 1] = acted[end]
        begin = end
    return _changed(acted, order, f"moves at {rate:.3g} per second")


def _even(slope: float, rate: float) -> bool:
    return abs(abs(slope) / rate - 1.0) < STEADY


def before_dead_zone(acted: np.ndarray, half: float) -> np.ndarray:
    large = np.abs(acted) > NEUTRAL * np.nanmax(np.abs(acted))
    return _changed(acted, acted + np.where(large, np.copysign(half, acted), 0.0), "moves at all")


def before_backlash(acted: np.ndarray, half: float) -> np.ndarray:
    """On the side to which it moved last; at rest before it first moves, in the middle."""
    least = MOVED * np.nanmax(np.abs(acted))
    way = np.zeros(len(acted))
    last, stood = 0.0, acted[0]
    for i, value in enumerate(acted):
        if abs(value - stood) > least:
            last, stood = float(np.sign(value - stood)), value
        way[i] = last
    return _changed(acted, acted + half * way, "moves at all")


def _changed(acted: np.ndarray, order: np.ndarray, what: str) -> np.ndarray:
    share = float(np.mean(np.abs(order - acted) > MOVED * np.nanmax(np.abs(acted))))
    if share < LEAST:
        raise ShiplogError(
            f"This fault cannot be written: the unit {what} in {share:.1%} of the rows.",
            hint="choose voyages in which it does so more often.",
        )
    return order


def _write(unit: str, of: Callable[[np.ndarray, np.ndarray, float], np.ndarray]):
    """A writer of `faults`: the unit's column becomes the order."""

    def write(columns: Columns, time: np.ndarray, share: float) -> None:
        acted = np.nan_to_num(columns[unit])
        columns[unit] = np.where(np.isfinite(columns[unit]), of(acted, time, share), np.nan)

    return write


BLUEBOAT_FAULTS: dict[str, Fault] = {
    "none": (lambda s: "", lambda c, t, s: None),
    "actuator_limit": (
        lambda s: f"{BLUEBOAT_UNIT} {BLUEBOAT_STOP:g} of full",
        _write(BLUEBOAT_UNIT, lambda a, t, s: beyond_stop(
            a, BLUEBOAT_STOP, BLUEBOAT_STOP + s * (BLUEBOAT_ORDER - BLUEBOAT_STOP)))),
    "actuator_dead_band": (
        lambda s: f"{BLUEBOAT_UNIT} {BLUEBOAT_DEAD * s:.2g} of full",
        _write(BLUEBOAT_UNIT, lambda a, t, s: before_dead_zone(a, BLUEBOAT_DEAD * s))),
}  # fmt: skip
HSVA_FAULTS: dict[str, Fault] = {
    "none": (lambda s: "", lambda c, t, s: None),
    "actuator_limit": (
        lambda s: "rudder 20 deg",
        _write("rudder", lambda a, t, s: beyond_stop(
            a, HSVA_STOP, HSVA_STOP + s * (HSVA_ORDER - HSVA_STOP)))),
    "actuator_rate": (
        lambda s: f"rudder {HSVA_RATE / DEGREE:.0f} deg/s",
        _write("rudder", lambda a, t, s: a + s * (before_ramps(a, t, HSVA_RATE) - a))),
    "actuator_dead_band": (
        lambda s: f"rudder {HSVA_PLAY * s / DEGREE:.2g} deg, backlash",
        _write("rudder", lambda a, t, s: before_backlash(a, HSVA_PLAY * s))),
}  # fmt: skip


def blueboat(folder: Path, out: Path) -> str:
    """Its thrusters' pulses jump, so that no rate can be written: a limit and a dead zone."""
    store, logs = _store(folder / BLUEBOAT, "blueboat", out / "actuators-blueboat")
    return written_table(
        store, logs, "*", BLUEBOAT_TRIAL, out / "actuators-blueboat", BLUEBOAT_FAULTS
    )


def kvlcc2(folder: Path, out: Path) -> str:
    """The rudder of HSVA's zigzags, whose ramps are even."""
    store, logs = _store(folder / HSVA, "kvlcc2", out / "actuators-kvlcc2")
    return written_table(store, logs, "HSVA*", HSVA_TRIAL, out / "actuators-kvlcc2", HSVA_FAULTS)


def _store(table: Path, profile: str, out: Path) -> tuple[Store, list[Path]]:
    store = Store(out / "store")
    if not store.entries():
        pl.read_parquet_schema(table)  # a wrong folder is said before anything is written
        convert([table], profiles.load(profile), out / "logs")
        ingest_logs(expand([out / "logs"]), profile, store)
    return store, expand([out / "logs"])
