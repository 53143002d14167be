"""How often the watch is wrong, and how soon and how well it is right, on kept segments.

    python -m pipelines.experiments.watching.rates KEPT

A rate is the number of alarms over the time of sailing without a change, with its exact Poisson
interval of 90 %. Peers see the same segments as one series, y = log χ² of the whitened error about
the nominal model: the detectors of river, each at the setting at which it raised as many alarms as
the watch in the same sailing, the best of them counted; and ruptures, which sees a voyage whole.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy.stats import chi2

from shiplog.live import alarm_threshold, calibration
from shiplog.live.alarm import Thresholds, Watcher
from shiplog.live.segment_products import Directions

RATES = (24.0, 6.0, 1.0)
DAY_S = 86_400.0


@dataclass(frozen=True)
class Known:
    """A ship's calibration as it was kept."""

    name: str
    directions: Directions
    median: float
    tails: tuple[alarm_threshold.Tail, alarm_threshold.Tail]
    segment_s: float

    def watcher(self, per_day: float) -> Watcher:
        return Watcher(
            self.directions, Thresholds.of(self.tails, per_day, self.segment_s), self.median
        )


def known(folder: Path) -> dict[str, Known]:
    found = {}
    for path in sorted(folder.glob("calibration-*.npz")):
        with np.load(path) as kept:
            r, q, _ = (int(n) for n in kept["widths"])
            causes = {k.removeprefix("cause "): kept[k] for k in kept.files if k[:6] == "cause "}
            name = path.stem.removeprefix("calibration-")
            median, tails = calibration.tails_of(kept)
            found[name] = Known(
                name, Directions(np.zeros(1), np.zeros((1, r)), np.zeros((1, q)), causes,
                                 float(kept["counts"])),
                median, tails, float(kept["segment_s"]),
            )  # fmt: skip
    return found


def legs(folder: Path, name: str) -> Iterator[np.ndarray]:
    for path in sorted(folder.glob(f"{name}-*.npy")):
        yield np.load(path).astype(float)


def interval(count: int) -> tuple[float, float]:
    """90 % of a Poisson mean of which so many were counted (Garwood 1936)."""
    low = 0.5 * chi2.ppf(0.05, 2 * count) if count else 0.0
    return float(low), float(0.5 * chi2.ppf(0.95, 2 * count + 2))


@dataclass
class Calm:
    """Sailing without a change: alarms, the days of it, and what was suspected."""

    count: int = 0
    days: float = 0.0
    suspects: Counter[str] = field(default_factory=Counter)


def false_alarms(ship: Known, folder: Path) -> dict[float, Calm]:
    """Rate → what was raised in sailing without a change. Every leg is a voyage of its own weather,
    watched one after the other; an alarm that stands ends with it."""
    found = {per_day: Calm() for per_day in RATES}
    for H in legs(folder, ship.name):
        change, other = highest(ship, H)
        for per_day, calm in found.items():
            calm.days += len(H) * ship.segment_s / DAY_S
            watcher = ship.watcher(per_day)
            of = watcher.thresholds
            if change <= of.change and other <= of.unexplained:
                continue
            for i, one in enumerate(H):
                alarm = watcher.add_product(one, i)
                if alarm is not None and not alarm.again:
                    calm.count += 1
                    calm.suspects[alarm.suspects[0].name if alarm.suspects else "unknown"] += 1
    return found


def highest(ship: Known, products: np.ndarray) -> tuple[float, float]:
    """The greatest log Z_n and lasting log χ² of a leg: where neither is above its threshold there
    is no alarm."""
    watcher = Watcher(ship.directions, Thresholds(np.inf, np.inf, False), ship.median)
    change, other = -np.inf, -np.inf
    for i, one in enumerate(products):
        watcher.add_product(one, i)
        assert watcher.latest is not None
        change, other = max(change, watcher.latest.total), max(other, watcher.lasting)
    return change, other


@dataclass(frozen=True)
class Half:
    """A voyage in whose middle something begins: H_s, ends [s], and the answer."""

    ship: str
    cause: str
    size: float
    begins: float
    ends: np.ndarray
    products: np.ndarray


def halves(folder: Path) -> list[Half]:
    found = []
    for path in sorted(folder.glob("half-*.npz")):
        with np.load(path) as kept:
            found.append(Half(
                str(kept["ship"]), str(kept["cause"]), float(kept["size"]), float(kept["begins"]),
                kept["times"], kept["H"].astype(float),
            ))  # fmt: skip
    return found


@dataclass(frozen=True)
class Outcome:
    """early: an alarm before there was anything. place of the cause among the suspects when the
    alarm was raised and when the voyage ended, 0 for the first; None where it is not named."""

    half: Half
    early: bool
    delay_s: float | None
    place: int | None
    last_place: int | None


def outcome(half: Half, ship: Known, per_day: float) -> Outcome:
    watcher = ship.watcher(per_day)
    early, first, last = False, None, None
    for end, one in zip(half.ends.tolist(), half.products, strict=True):
        alarm = watcher.add_product(one, round(end * 1e9))
        if alarm is None:
            continue
        if end <= half.begins:
            early = early or not alarm.again
            continue
        first = first or (end - half.begins, alarm)
        last = alarm
    place = None if first is None else _place(half.cause, first[1].suspects)
    final = None
    if watcher.latest is not None and last is not None:
        names = list(dict.fromkeys(s.partition(":")[0] for s in watcher.latest.suspects))
        final = names.index(half.cause) if half.cause in names else None
    return Outcome(half, early, None if first is None else first[0], place, final)


def _place(cause: str, suspects) -> int | None:
    names = [one.name.partition(":")[0] for one in suspects]
    return names.index(cause) if cause in names else None


def series(products: np.ndarray) -> np.ndarray:
    """y = log χ²_s about the nominal model."""
    return np.log(np.maximum(products[:, 0, 0], 1e-9))


def peers() -> dict[str, tuple[Callable[[float], object], tuple[float, ...]]]:
    """Detectors of river, made by the number that sets how often they are wrong."""
    from river import drift  # pyright: ignore[reportMissingImports]  # a peer

    return {
        "ADWIN": (lambda d: drift.ADWIN(delta=d, min_window_length=2, grace_period=4, clock=1),
                  tuple(10.0 ** -np.arange(0.0, 12.0, 0.5))),
        "PageHinkley": (lambda t: drift.PageHinkley(min_instances=10, delta=0.1, threshold=t,
                                                    mode="up"),
                        tuple(np.geomspace(0.5, 60.0, 30))),
        "KSWIN": (lambda a: drift.KSWIN(alpha=a, window_size=30, stat_size=10, seed=1),
                  tuple(10.0 ** -np.arange(1.0, 12.0, 0.5))),
    }  # fmt: skip


def alarms_of(detector, values: np.ndarray) -> list[int]:
    found = []
    for i, value in enumerate(values):
        detector.update(float(value))
        if detector.drift_detected:
            found.append(i)
    return found


def best_of_river(folder: Path, there: dict[str, Known], most: int) -> list[str]:
    """Of each detector, its setting that raises no more than `most` alarms in the sailing without a
    change, and what it then finds of the half-way voyages."""
    calm = [series(H) for name in there for H in legs(folder, name)]
    lines = []
    for name, (make, settings) in peers().items():
        chosen = None
        for setting in settings:  # from the most nervous on
            if sum(len(alarms_of(make(setting), y)) for y in calm) <= most:
                chosen = setting
                break
        if chosen is None:
            lines.append(f"river {name}: no setting raises so few alarms")
            continue
        delays = []
        for half in halves(folder):
            at = [half.ends[i] - half.begins for i in alarms_of(make(chosen),
                                                                series(half.products))]  # fmt: skip
            later = [d for d in at if d > 0.0]
            delays.append(later[0] if later else None)
        lines.append(_found(f"river {name} at {chosen:.3g}", delays))
    return lines


def of_ruptures(folder: Path, there: dict[str, Known], most: int) -> list[str]:
    """Whole voyages, cut by least squares (Pelt): found where a cut lies within three segments of
    the beginning; the penalty as the settings of river."""
    import ruptures  # pyright: ignore[reportMissingImports]  # a peer

    def cuts(values: np.ndarray, penalty: float) -> list[int]:
        algorithm = ruptures.Pelt(model="l2", min_size=3, jump=1).fit(values)
        return algorithm.predict(pen=penalty)[:-1]

    calm = [series(H) for name in there for H in legs(folder, name)]
    for penalty in np.geomspace(0.5, 500.0, 25):
        if sum(len(cuts(y, penalty)) for y in calm) <= most:
            right = 0
            for half in halves(folder):
                at = int(np.searchsorted(half.ends, half.begins))
                right += any(abs(c - at) <= 3 for c in cuts(series(half.products), penalty))
            return [
                f"ruptures Pelt at {penalty:.3g}: {right} of {len(halves(folder))} (afterwards)"
            ]
    return ["ruptures Pelt: no penalty cuts so seldom"]


def _found(name: str, delays: list[float | None]) -> str:
    known_ = [d for d in delays if d is not None]
    middle = f", median {np.median(known_) / 60.0:.1f} min" if known_ else ""
    return f"{name}: {len(known_)} of {len(delays)}{middle}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kept", type=Path)
    folder = parser.parse_args().kept
    there = known(folder)
    calm = {ship.name: false_alarms(ship, folder) for ship in there.values()}
    for per_day in RATES:
        for name, each in calm.items():
            own = each[per_day]
            low, high = interval(own.count)
            print(
                f"  {name}: {own.count} in {own.days:.2f} days, {own.count / own.days:.2f} a day "
                f"({low / own.days:.2f} to {high / own.days:.2f}), {dict(own.suspects)}"
            )
        count = sum(each[per_day].count for each in calm.values())
        days = sum(each[per_day].days for each in calm.values())
        low, high = interval(count)
        between = f"{low / days:.2f} to {high / days:.2f}"
        print(
            f"{per_day:g} a day asked: {count} alarms in {days:.2f} days, expected "
            f"{per_day * days:.1f}; {count / days:.2f} a day ({between})"
        )
        outcomes = [outcome(h, there[h.ship], per_day) for h in halves(folder) if h.ship in there]
        print(_found("  watch", [o.delay_s for o in outcomes]))
        raised = [o for o in outcomes if o.delay_s is not None]
        for what, of in (
            ("at the alarm", lambda o: o.place),
            ("at the end", lambda o: o.last_place),
        ):
            first = sum(of(o) == 0 for o in raised)
            two = sum(of(o) in (0, 1) for o in raised)
            print(f"  {what}: first suspect right {first}, in the first two {two} of {len(raised)}")
        print(f"  before anything began: {sum(o.early for o in outcomes)} of {len(outcomes)}")
        if per_day == RATES[0]:
            for line in (*best_of_river(folder, there, count), *of_ruptures(folder, there, count)):
                print(f"  {line}")


if __name__ == "__main__":
    main()
