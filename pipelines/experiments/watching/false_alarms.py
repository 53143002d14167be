"""Days of sailing without a change, watched leg by leg: how often the watch is wrong.

    python -m pipelines.experiments.watching.false_alarms SHIPS KEPT OUT.jsonl --days 30
    python -m pipelines.experiments.watching.false_alarms SHIPS KEPT OUT.jsonl --report

SHIPS holds a folder a ship with `store` and `base`, KEPT the calibrations of `segments_kept`. Rows
are made by the simulators' instruments and `ingest`'s rules, and all segments of a leg are
linearised together: a day takes a minute or two, and `same_as_live` shows that the alarms are those
of `shiplog watch`. One line a leg is appended to OUT.jsonl; what is there is not done again. Legs
count from FIRST: no number of the alarm was set on them.

A rate is the number of alarms over the time, with its exact Poisson interval of 90 %.
"""

from __future__ import annotations

import argparse
import json
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from threadpoolctl import threadpool_limits

from pipelines.experiments.watching import rates, sailing, segments_kept
from pipelines.experiments.watching.rates import DAY_S, RATES, Known
from shiplog.live import segment_products

FIRST = 300_000  # hours after FIRST_DAY, and the seed of weather and noise


def done(out: Path) -> list[dict[str, Any]]:
    """The legs that were watched; a line that a kill cut short is left out."""
    found = []
    for line in out.read_text(encoding="utf-8").splitlines() if out.exists() else []:
        try:
            found.append(json.loads(line))
        except json.JSONDecodeError:
            continue
    return found


def watched(ship: Known, products) -> dict[str, list[dict[str, Any]]]:
    """Rate → the alarms of a leg of products H_s [S, N, N], a voyage of its own."""
    found: dict[str, list[dict[str, Any]]] = {}
    for per_day in RATES:
        watcher, alarms = ship.watcher(per_day), []
        for i, one in enumerate(products):
            alarm = watcher.add_product(one, i)
            if alarm is not None and not alarm.again:
                first = alarm.suspects[0].name if alarm.suspects else "unknown"
                alarms.append({"segment": i, "suspect": first, "nats": alarm.statistic})
        found[f"{per_day:g}"] = alarms
    return found


def watch_legs(ships: Path, kept: Path, out: Path, days: float, only: list[str]) -> None:
    """Legs of one ship after another, each ship's share of the days; the ships in turn."""
    known = rates.known(kept)
    chosen = [s for s in sailing.SHIPS if s.name in known and (not only or s.name in only)]
    there = {s: segments_kept.campaign_of(ships / s.name) for s in chosen}
    maps = {s: segment_products.directions(of.campaign) for s, of in there.items()}
    before = {(one["ship"], one["leg"]) for one in done(out)}
    legs = round(days * DAY_S / sailing.LEG_S / len(chosen))
    with out.open("a", encoding="utf-8") as stream:
        for number in range(FIRST, FIRST + legs):
            for ship, of in there.items():
                if (ship.name, number) in before:
                    continue
                began = time.process_time()
                record = sailing.record_of(sailing.leg(ship, number), of.record.profile)
                H = segments_kept.products(of, record, maps[ship])
                line = {
                    "ship": ship.name, "leg": number, "seconds": len(H) * of.grid.seconds,
                    "alarms": watched(known[ship.name], H), "cpu_s": time.process_time() - began,
                    "resident_mb": resident_mb(),
                }  # fmt: skip
                stream.write(json.dumps(line) + "\n")
                stream.flush()


def resident_mb() -> float:
    """Memory of this process now."""
    for line in Path("/proc/self/status").read_text(encoding="utf-8").splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1]) / 1024.0
    return float("nan")


def report(legs: list[dict[str, Any]]) -> Iterator[str]:
    """The table, and the ships and suspects of the alarms."""
    days = sum(one["seconds"] for one in legs) / DAY_S
    yield f"{len(legs)} legs, {days:.2f} days"
    yield "| asked a day | expected | raised | a day, with 90 % interval |"
    yield "| ---: | ---: | ---: | --- |"
    for per_day in RATES:
        count = sum(len(one["alarms"][f"{per_day:g}"]) for one in legs)
        low, high = rates.interval(count)
        yield (
            f"| {per_day:g} | {per_day * days:.1f} | {count} | {count / days:.2f} "
            f"({low / days:.2f} to {high / days:.2f}) |"
        )
    for name in dict.fromkeys(one["ship"] for one in legs):
        own = [one for one in legs if one["ship"] == name]
        lasted = sum(one["seconds"] for one in own) / DAY_S
        counts = {f"{r:g}": sum(len(o["alarms"][f"{r:g}"]) for o in own) for r in RATES}
        yield f"{name}: {lasted:.2f} days, {counts}"
    suspects = Counter(a["suspect"] for one in legs for a in one["alarms"][f"{RATES[0]:g}"])
    yield f"suspects at {RATES[0]:g} a day: {dict(suspects.most_common())}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("ships", type=Path)
    parser.add_argument("kept", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--days", type=float, default=30.0)
    parser.add_argument("--only", nargs="*", default=[])
    parser.add_argument("--report", action="store_true")
    given = parser.parse_args()
    if not given.report:
        with threadpool_limits(1, user_api="blas"):  # of matrices too small to share out
            watch_legs(given.ships, given.kept, given.out, given.days, given.only)
    print(*report(done(given.out)), sep="\n")


if __name__ == "__main__":
    main()
