"""What a simulation gets wrong, and where: channel by channel, regime by regime, minute by minute.

L of Eq. 8 is a sum over samples and channels, so it can be shared out among them exactly.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import polars as pl

from shiplog.nomenclature import channels
from shiplog.nomenclature.frames import wrap
from shiplog.ship_profile.profile import Profile
from shiplog.simulation.scoring import loss_shares
from shiplog.simulation.window_series import VELOCITY_COLUMNS, WindowSeries, apparent_wind
from shiplog.voyages.windows.windows import seconds_since

CHANNELS = tuple(c.name for c in channels.VELOCITY)
MINUTE = 60.0  # s
RARE_SHARE = 0.03  # of the time: what is rarer is an incident, not a regime
STANDS_OUT = 0.05  # nats of `_score`: 20 % of the error in 15 % of the time
CONDITION_GAIN = 1.2  # how much more a second or third condition must say
CONDITIONS = 3
RECENT = 2.0  # s, over which a change of the controls counts as moving
WIND_SIDES = ("ahead", "starboard", "astern", "port")
COMPASS = ("north", "east", "south", "west")
THIRDS = ("first", "middle", "last")
WIDTHS = (0.5, 1.0, 2.0, 5.0)  # m/s, of a bin of wind speed


@dataclass(frozen=True, slots=True)
class ChannelBreakdown:
    """One velocity's part in the error. `within` of it arises in `occurs` of the time."""

    channel: str
    share: float
    where: str
    within: float
    occurs: float

    def as_json(self) -> dict:
        return {"channel": self.channel, "share_of_error": self.share, "where": self.where}


@dataclass(frozen=True, slots=True)
class Minute:
    """The worst minute; `share` of all error."""

    voyage: str
    start_s: float
    share: float


@dataclass(frozen=True)
class Wrong:
    """`channels` in order of their share; `diverged`: windows that diverged, left out of all."""

    channels: tuple[ChannelBreakdown, ...]
    worst: Minute | None
    timeline: pl.DataFrame
    diverged: int


def explain(
    error: np.ndarray, data: WindowSeries, windows: pl.DataFrame, profile: Profile
) -> Wrong:
    """Of N windows, rolled out and measured.

    error    [N, I, 6]  simulated less measured, channels.STATE
    data     what drove the rollouts, and what was measured
    windows  [N] rows, as `Windows.plan` has them: voyage, elapsed (s into the voyage); and share
             (of the campaign, at the middle of the window)
    """
    finite = np.isfinite(error).all((1, 2))
    rows = timeline(error, data, windows)
    kept = WindowSeries(*(values[finite] for values in data))
    cost = loss_shares(error[finite], kept.dt)
    total = cost.sum()
    if not total:
        return Wrong((), None, rows, int((~finite).sum()))
    regimes = list(_regimes(kept, windows[np.flatnonzero(finite).tolist()], profile))
    found = []
    for i, name in enumerate(CHANNELS):
        where, within, occurs = _where(cost[..., i], kept.steps, regimes)
        found.append(
            ChannelBreakdown(name, float(cost[..., i].sum() / total), where, within, occurs)
        )
    found.sort(key=lambda c: -c.share)
    return Wrong(tuple(found), worst_minute(rows), rows, int((~finite).sum()))


def timeline(error: np.ndarray, data: WindowSeries, windows: pl.DataFrame) -> pl.DataFrame:
    """One row a sample of a window: voyage, window, time_s (into the voyage), the error of surge,
    sway [m/s] and yaw_rate [rad/s], and loss: what the sample adds to L."""
    count, size = error.shape[:2]
    elapsed = seconds_since(np.asarray(data.dt))
    columns = {
        "voyage": np.repeat(windows["voyage"].to_numpy(), size),
        "window": np.repeat(np.arange(count), size),
        "time_s": (windows["elapsed"].to_numpy()[:, None] + elapsed).ravel(),
    }
    with np.errstate(over="ignore", invalid="ignore"):
        loss = loss_shares(error, data.dt).sum(-1).ravel()
    each = dict(zip(CHANNELS, error[..., VELOCITY_COLUMNS].reshape(-1, 3).T, strict=True))
    return pl.DataFrame(columns | each | {"loss": loss})


def worst_minute(rows: pl.DataFrame) -> Minute | None:
    """The minute with most of the error, of a `timeline`; None where nothing is wrong.

    Where windows overlap, an instant counts once, with the mean of what they say of it.
    """
    ended = rows.filter(pl.col("loss").is_finite().not_())["window"].unique()
    instants = (
        rows.filter(pl.col("window").is_in(ended.implode()).not_())
        .group_by("voyage", pl.col("time_s").round(3))
        .agg(pl.col("loss").mean())
        .sort("voyage", "time_s")
    )
    total = float(instants["loss"].sum())
    best = None
    for (voyage,), part in instants.group_by("voyage", maintain_order=True):
        time = part["time_s"].to_numpy()
        sums = np.concatenate(([0.0], np.cumsum(part["loss"].to_numpy())))
        within = sums[np.searchsorted(time, time + MINUTE)] - sums[:-1]
        at = int(within.argmax())
        if total and (best is None or within[at] / total > best.share):
            best = Minute(str(voyage), float(time[at]), float(within[at] / total))
    return best


# --- where: the regime that holds more of the error than of the time ------------------------------

Regime = tuple[str, str, np.ndarray]  # kind, words, [N, I] bool


def _where(cost: np.ndarray, steps: np.ndarray, regimes: list[Regime]) -> tuple[str, float, float]:
    """In words, and what share of the error [N, I] lies in what share of the time."""
    chosen: list[tuple[str, str]] = []
    inside = np.ones(cost.shape, dtype=bool)
    best = STANDS_OUT / CONDITION_GAIN
    for _ in range(CONDITIONS):
        kinds = {kind for kind, _ in chosen}
        rated = [
            (_score(cost, steps, inside & mask), kind, words, mask)
            for kind, words, mask in regimes
            if kind not in kinds
        ]
        score, kind, words, mask = max(rated, key=lambda r: r[0])
        if score < CONDITION_GAIN * best:
            break
        best, inside = score, inside & mask
        chosen.append((kind, words))
    if not chosen:
        return "everywhere alike", 1.0, 1.0
    within, occurs = (float(v[inside].sum() / v.sum()) for v in (cost, steps))
    order = [kind for kind, _, _ in regimes]
    text = ", ".join(w for _, w in sorted(chosen, key=lambda c: order.index(c[0])))
    return f"{text} ({within:.0%} of it in {occurs:.0%} of the time)", within, occurs


def _score(cost: np.ndarray, steps: np.ndarray, inside: np.ndarray) -> float:
    """s log(s/t) of a share s of the error in a share t of the time: its part in their Kullback-
    Leibler divergence. It asks for much of the error, and for more of it than of the time.

    The window that speaks for it most is not heard: one bad window makes no regime.
    """
    of_cost, of_time = ((v * inside).sum(1) for v in (cost, steps))
    heard = np.arange(len(cost)) != of_cost.argmax()
    all_cost, all_time = cost[heard].sum(), steps[heard].sum()
    within, time = of_cost[heard].sum(), of_time[heard].sum()
    if not within or time < RARE_SHARE * all_time:
        return 0.0
    share = within / all_cost
    return float(share * np.log(share * all_time / time))


def _regimes(data: WindowSeries, windows: pl.DataFrame, profile: Profile) -> Iterator[Regime]:
    """All conditions of a sample, kind by kind, in the order of a sentence."""
    _, u, _, v, _, r = np.moveaxis(data.measured, -1, 0)
    typical = max(float(np.sqrt((u**2 + v**2).mean())), 1e-9)
    moving = np.hypot(u, v) >= 0.2 * typical
    sideways = moving & (np.abs(v) > np.abs(u))
    along = moving & ~sideways
    yield "speed", "hardly moving", ~moving
    yield "speed", "moving sideways", sideways
    yield "speed", "astern", along & (u < 0.0)
    yield "speed", "slow ahead", along & (u > 0.0) & (u < typical)
    yield "speed", f"ahead at {typical:.2g} m/s and more", along & (u >= typical)
    turn = 0.5 * float(np.sqrt((r**2).mean()))
    yield "turning", "on a steady course", np.abs(r) <= turn
    yield "turning", "turning to port", r < -turn
    yield "turning", "turning to starboard", r > turn
    yield from _controls(data, profile)
    if profile.has_wind:
        yield from _wind(data)
    yield from _place(data, geodetic=profile.sensors.kind("position") == "geodetic")
    third = np.minimum((3.0 * windows["share"].to_numpy()).astype(int), 2)
    for i, name in enumerate(THIRDS):
        mask = np.broadcast_to((third == i)[:, None], u.shape)
        yield "campaign", f"in the {name} third of the campaign", mask


def _controls(data: WindowSeries, profile: Profile) -> Iterator[Regime]:
    angles = [i for i, a in enumerate(profile.actuators) if a.kind in ("rudder", "azimuth")]
    drives = [i for i, a in enumerate(profile.actuators) if a.kind in ("propeller", "thruster")]
    if angles:
        name = profile.actuators[angles[0]].kind + ("s" if len(angles) > 1 else "")
        back = max(1, round(RECENT / float(np.median(data.dt))))
        values = data.actuator[..., angles]
        before = np.concatenate((np.repeat(values[:, :1], back, axis=1), values), 1)
        change = np.abs(wrap(values - before[:, : values.shape[1]]))
        moved = (change > 0.25 * np.maximum(values.std((0, 1)), 1e-9)).any(-1)
        yield "angle", f"{name} moving", moved
        yield "angle", f"{name} still", ~moved
    if drives:
        values = data.actuator[..., drives]
        part = values / np.maximum(np.abs(values).max((0, 1)), 1e-9)
        still = (np.abs(part) < 0.05).all(-1)
        name = "propeller" if profile.actuators[drives[0]].kind == "propeller" else "thruster"
        name += "s" if len(drives) > 1 else ""
        astern = (part.mean(-1) < 0.0) & ~still
        strong = ~still & ~astern & (part.max(-1) >= 0.7)
        yield "power", f"{name} stopped", still
        yield "power", f"{name} reversed", astern
        yield "power", f"{name} at low power", ~(still | astern | strong)
        yield "power", f"{name} at high power", strong


def _wind(data: WindowSeries) -> Iterator[Regime]:
    """The apparent wind, which the force comes from."""
    apparent = apparent_wind(data.measured, data.wind)
    speed, side = apparent[..., 0], _quarter(apparent[..., 1])
    for i, name in enumerate(WIND_SIDES):
        yield "wind side", f"wind from {name}", side == i
    strong = float(np.quantile(speed, 0.95))
    width = next((w for w in WIDTHS if strong / w <= 6.0), WIDTHS[-1])
    for low in width * np.arange(np.floor(speed.max() / width) + 1.0):
        words = f"wind of {low:g} to {low + width:g} m/s"
        yield "wind speed", words, (speed >= low) & (speed < low + width)


def _place(data: WindowSeries, geodetic: bool) -> Iterator[Regime]:
    """Quarters of where it was, and of where it looked. A local frame need not face north."""
    x0, y0 = data.measured[..., 0], data.measured[..., 2]
    north, east = x0 >= np.median(x0), y0 >= np.median(y0)
    for up, long in ((True, "north"), (False, "south")):
        for right, short in ((True, "east"), (False, "west")):
            words = f"in the {long}-{short} of its waters"
            if not geodetic:
                words = (
                    f"where x₀ {'≥' if up else '<'} {np.median(x0):.0f} m "
                    f"and y₀ {'≥' if right else '<'} {np.median(y0):.0f} m"
                )
            yield "place", words, (north == up) & (east == right)
    quarter = _quarter(data.measured[..., 4])
    for i, name in enumerate(COMPASS):
        words = f"heading {name}" if geodetic else f"heading around {90 * i} deg"
        yield "heading", words, quarter == i


def _quarter(angle: np.ndarray) -> np.ndarray:
    """0 around zero, 1 around 90 deg, and on [rad]."""
    return np.round(angle / (0.5 * np.pi)).astype(int) % 4
