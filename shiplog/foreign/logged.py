"""States that a simulator wrote into a log, as `shiplog.ShipState` on a topic of its own.

Nothing can be asked of it but where it was. Of each window its own path is taken, moved and turned
to where the ship was: with the simulator's states s and the ship's x at the window's beginning,

    η(t) = η_x(0) + R(ψ_x(0) - ψ_s(0)) (η_s(t) - η_s(0)),   ψ(t) = ψ_s(t) + ψ_x(0) - ψ_s(0)

and the velocities as they were logged. Where the simulator was not restarted with the ship's
velocities, what it had got wrong before a window is in the window's error.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl

from shiplog.exceptions import RunError, listed
from shiplog.foreign.source import SimulatorError
from shiplog.logs.reading.read import Reading, read
from shiplog.nomenclature.channels import STATE
from shiplog.nomenclature.frames import wrap
from shiplog.voyages.windows.windows import Windows

FIELDS = {  # of shiplog.ShipState, and its factor to SI
    "x0": ("x0_m", 1.0), "surge": ("surge_mps", 1.0), "y0": ("y0_m", 1.0),
    "sway": ("sway_mps", 1.0), "heading": ("heading_deg", np.pi / 180.0),
    "yaw_rate": ("yaw_rate_degps", np.pi / 180.0),
}  # fmt: skip
FAR_S = 1.5  # s to the next state, beyond which there is none
LOG_ENDINGS = (".mcap",)


def states_of(
    logs: Sequence[Path], topic: str, rows: pl.DataFrame, hashes: Mapping[str, str | None]
) -> pl.DataFrame:
    """voyage, elapsed and the state of the simulator, SI, at rows of voyages that these logs are
    of; a null where it was not logged. Raises SimulatorError.

    rows     voyage, time, elapsed
    hashes   voyage → SHA-256 of its log
    """
    by_hash: dict[str, list[str]] = {}
    for name, sha256 in hashes.items():
        if sha256:
            by_hash.setdefault(sha256, []).append(name)
    parts, others = [], []
    for path in _files(logs):
        found = read(path, {topic: {field for field, _ in FIELDS.values()}})
        names = by_hash.get(found.contents.sha256, [])
        if not names:
            others.append(path.name)
            continue
        time, state = _series(found, topic, path)
        for name in names:
            own = rows.filter(pl.col("voyage") == name)
            parts.append(_at(own, time, state))
    if not parts:
        raise SimulatorError(
            f"None of these logs is of a voyage of the store: {listed(others, most=4)}.",
            hint="give the very logs that were ingested, which also hold the simulator's states.",
        )
    return pl.concat(parts)


def _files(logs: Sequence[Path]) -> list[Path]:
    found = []
    for path in logs:
        found += sorted(path.glob("*.mcap")) if path.is_dir() else [path]
    if not found:
        raise SimulatorError(
            f"There is no log in {listed(str(path) for path in logs)}.",
            hint="give MCAP files, or folders of them.",
        )
    return found


def _series(found: Reading, topic: str, path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Times [n], ns, in order, and states [n, 6]. Raises SimulatorError."""
    frame = found.frames.get(topic)
    fields = [field for field, _ in FIELDS.values()]
    if frame is None or not frame.height:
        topics = [name for name in found.contents.topics if name.startswith("/sim/")]
        raise SimulatorError(
            f"{path.name} has no states on {topic}.",
            hint=f"it has {listed(topics or list(found.contents.topics), most=8)}.",
        )
    lacking = [field for field in fields if field not in frame.columns]
    if lacking:
        raise SimulatorError(
            f"{topic} of {path.name} lacks {listed(lacking)}.",
            hint="log states as shiplog.ShipState.",
        )
    stamp = "stamp" if frame["stamp"].null_count() < frame.height else "log_time"
    frame = frame.drop_nulls(stamp).sort(stamp).unique(stamp, keep="last", maintain_order=True)
    time = frame[stamp].to_physical().to_numpy()
    values = [frame[field].to_numpy() * factor for field, factor in FIELDS.values()]
    state = np.stack(values, 1).astype(float)
    sound = np.isfinite(state).all(1)
    return time[sound], state[sound]


def _at(rows: pl.DataFrame, time: np.ndarray, state: np.ndarray) -> pl.DataFrame:
    wanted = rows["time"].to_physical().to_numpy()
    near = np.clip(np.searchsorted(time, wanted), 1, max(len(time) - 1, 1))
    gap = np.minimum(np.abs(time[near - 1] - wanted), np.abs(time[near % len(time)] - wanted))
    known = gap <= FAR_S * 1e9
    columns = {}
    for i, channel in enumerate(STATE):
        values = np.unwrap(state[:, i]) if channel.circular else state[:, i]
        found = np.interp(wanted, time, values)
        columns[channel.name] = np.where(known, found, np.nan)
    return rows.select("voyage", "elapsed").with_columns(
        **{name: pl.Series(values).fill_nan(None) for name, values in columns.items()}
    )


@dataclass(frozen=True)
class LoggedSimulator:
    """Windows of what was logged.

    states   as `states_of` gives them
    """

    name: str
    states: pl.DataFrame

    def simulate(self, windows: Windows) -> np.ndarray:
        """States [N, I, 6]; not a number where nothing was logged. Raises RunError for a voyage
        that has none."""
        count, size, _ = windows.state.shape
        found = np.full((count, size, 6), np.nan)
        names = windows.plan["voyage"].to_list()
        at = windows.plan["elapsed"].to_numpy()[:, None] + windows.since
        known = {
            name: own for (name,), own in self.states.group_by("voyage", maintain_order=True)
        }  # fmt: skip
        lacking = sorted(set(names) - set(known))
        if lacking:
            raise RunError(
                f"The run has no logged states of {listed(lacking)}.",
                hint="train it again with --logs of these voyages, too.",
            )
        for n, name in enumerate(names):
            own = known[name]
            time = own["elapsed"].to_numpy()
            row = np.clip(np.searchsorted(time, at[n] - 0.5), 0, len(time) - 1)
            values = own.select(c.name for c in STATE).to_numpy()[row].astype(float)
            values[np.abs(time[row] - at[n]) > FAR_S] = np.nan
            found[n] = _moved(values, windows.state[n, 0])
        return found

    def spread(self, windows: Windows) -> np.ndarray:
        """[N, I, 6], zero."""
        return np.zeros(windows.state.shape)


def _moved(own: np.ndarray, begin: np.ndarray) -> np.ndarray:
    """A path [I, 6] from where the ship was [6]."""
    found = own.copy()
    turned = float(wrap(np.array(begin[4] - own[0, 4])))
    c, s = np.cos(turned), np.sin(turned)
    north, east = own[:, 0] - own[0, 0], own[:, 2] - own[0, 2]
    found[:, 0] = begin[0] + c * north - s * east
    found[:, 2] = begin[2] + s * north + c * east
    found[:, 4] = begin[4] + np.unwrap(own[:, 4]) - own[0, 4]
    found[0] = begin if np.isfinite(own[0]).all() else np.nan
    return found
