"""The result of `shiplog plan`: the manoeuvre, the intervals to expect, the causes it tells apart;
its schedule for `simulate`, and a sheet for the bridge."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from shiplog.diagnosis.thresholds import SHOWS_NATS
from shiplog.exceptions import listed
from shiplog.machine import files
from shiplog.nomenclature.contract import CONTRACT
from shiplog.nomenclature.numbers import NINETY_SPREADS, counted, figure
from shiplog.planning.causes import Apart, Pair
from shiplog.planning.plan import Plan
from shiplog.report.evaluation.text_table import inert, table
from shiplog.report.result import Printed
from shiplog.ship_profile.profile import Profile
from shiplog.simulation import schedules

SCHEDULE, BRIDGE, FACTS = "schedule.csv", "bridge.md", "plan.json"
MOST_ROWS = 16  # coefficients in the text, those whose intervals become narrowest; JSON has all
MOST_PAIRS = 5  # pairs of causes in the text


@dataclass(frozen=True, repr=False)
class Planned(Printed):
    """plan     None of a run that has no coefficients to plan for
    apart    name of a manoeuvre → what it says of causes; empty without the training voyages
    notes    sentences on what was not done, and why
    """

    run: str
    profile: Profile
    plan: Plan | None
    apart: dict[str, Apart]
    folder: Path
    notes: tuple[str, ...] = ()

    @property
    def lines(self) -> list[str]:
        found = [] if self.plan is None else _plan_lines(self.run, self.plan)
        for name, apart in self.apart.items():
            found += ["", *_apart_lines(name, apart)]
        found += ["", *self.notes] if self.notes else []
        if self.plan is not None:
            schedule = self.folder / SCHEDULE
            found += [
                "", f"For the bridge: {self.folder / BRIDGE}. As orders: {schedule}",
                f"Next: shiplog simulate RUN --schedule {schedule}",
            ]  # fmt: skip
        return found

    @property
    def json(self) -> dict:
        return {
            "contract": CONTRACT,
            "run": self.run,
            "plan": None if self.plan is None else _plan_json(self.plan, self.profile),
            "causes": {name: _apart_json(apart) for name, apart in self.apart.items()},
            "notes": list(self.notes),
        }

    def save(self) -> None:
        """Schedule, bridge sheet and JSON."""
        self.folder.mkdir(parents=True, exist_ok=True)
        if self.plan is not None:
            names = self.profile.actuator_names
            orders = self.plan.found.schedule(names, self.plan.limits.seconds)
            files.write_text(self.folder / SCHEDULE, schedules.text_of(orders, self.profile))
            files.write_text(self.folder / BRIDGE, inert(bridge_sheet(self.plan, self.profile)))
        files.write_json(self.folder / FACTS, self.json)


def _plan_lines(run: str, plan: Plan) -> list[str]:
    shown = sorted((o for o in plan.expected if o.shown), key=lambda o: o.planned / o.now)
    hidden = [o.name for o in plan.expected if not o.shown]
    seconds = plan.limits.seconds
    head = (
        "coefficient",
        "what",
        "value",
        "now ±",
        f"after {plan.zigzag[0]} ±",
        "after the plan ±",
    )
    rows = [
        (o.name, o.meaning, figure(o.value, 3),
         *(figure(NINETY_SPREADS * e) for e in (o.now, o.zigzag, o.planned)))
        for o in shown[:MOST_ROWS]
    ]  # fmt: skip
    lines = [
        f"{seconds:.0f} s for {run}: 90 % intervals {figure(plan.narrower)} times narrower than "
        f"after a {plan.zigzag[0]} of the same time, in the median of "
        f"{counted(len(shown), 'coefficient')} that either shows.",
        "",
        table(head, rows, head[2:]),
    ]
    if len(shown) > MOST_ROWS:
        lines.append(f"And {counted(len(shown) - MOST_ROWS, 'more coefficient')}, in the JSON.")
    if hidden:
        lines.append(f"Neither shows {listed(hidden, most=8)}.")
    if plan.outside.anywhere:
        lines.append(f"The plan is {plan.outside.sentence}: there the model may be wrong.")
    return lines


def _apart_lines(name: str, apart: Apart) -> list[str]:
    """Worst pair first, and the sensor that would help."""
    count = len(apart.pairs)
    told = sum(pair.nats >= SHOWS_NATS for pair in apart.pairs)
    lines = [
        f"{name}: tells {told} of {counted(count, 'pair')} of causes apart (an expected log Bayes "
        f"factor of {SHOWS_NATS:g} nats or more, at realistic sizes)."
    ]
    if apart.unseen:
        lines.append(f"  Would not show at all: {listed(apart.unseen)}.")
    for pair in apart.twins[:MOST_PAIRS]:
        lines.append(f"  {_pair_sentence(pair)}")
    return lines


def _pair_sentence(pair: Pair) -> str:
    aid = (
        f"; {pair.sensor} would tell them apart ({figure(pair.with_it)} nats)"
        if pair.sensor and pair.with_it >= SHOWS_NATS
        else ""
    )
    return f"{pair.a} and {pair.b}: {figure(pair.nats)} nats{aid}."


def _plan_json(plan: Plan, profile: Profile) -> dict:
    times = [plan.found.hold * k for k in range(len(plan.found.orders))]
    return {
        "seconds": plan.limits.seconds,
        "narrower": plan.narrower,
        "compared_with": plan.zigzag[0],
        "orders": [
            {"time_s": t, **dict(zip(profile.actuator_names, row, strict=True))}
            for t, row in zip(times, plan.found.orders.tolist(), strict=True)
        ],
        "coefficients": [one.as_json() for one in plan.expected],
        "outside": plan.outside.sentence,
        "rounds": plan.found.rounds,
    }


def _apart_json(apart: Apart) -> dict:
    return {
        "labels": list(apart.labels),
        "nats": apart.matrix.tolist(),
        "alone": apart.alone.tolist(),
        "pairs": [
            {"a": p.a, "b": p.b, "nats": p.nats, "sensor": p.sensor, "with_sensor": p.with_it}
            for p in apart.pairs
        ],
        "untested": dict(apart.untested),
    }


def bridge_sheet(plan: Plan, profile: Profile) -> str:
    """Markdown: what to order when, and what the ship should be doing then."""
    sailed, orders = plan.found.sailed, plan.found.orders
    state = sailed.state[0]
    limits = plan.limits
    units = {a.name: ("deg", 180.0 / math.pi) if a.si_unit == "rad" else (a.si_unit, 1.0)
             for a in profile.actuators}  # fmt: skip
    head = ["time", *(f"{n} [{units[n][0]}]" for n in profile.actuator_names),
            "heading changed [deg]", "speed [m/s]", "ahead [m]", "aside [m]"]  # fmt: skip
    rows = []
    for k, row in enumerate(orders):
        at = min(round(k * plan.found.hold / (sailed.time[1] - sailed.time[0])), len(state) - 1)
        now = state[at]
        rows.append((
            _clock(k * plan.found.hold),
            *(figure(v * units[n][1], 3) for n, v in zip(profile.actuator_names, row, strict=True)),
            f"{math.degrees(now[4]):+.0f}", figure(now[1], 2), f"{now[0]:.0f}", f"{now[2]:.0f}",
        ))  # fmt: skip
    known = np.isfinite(state).all(1)
    ahead, aside = (state[known][:, i] for i in (0, 2))
    return "\n".join([
        f"# {profile.ship.name}: manoeuvre to sail",
        "",
        f"{_clock(limits.seconds)} in all, from a straight course at {figure(state[0, 1])} m/s. "
        "Give each order at its time and hold it until the next. The master is free to break off.",
        "",
        f"Water it takes by the simulation: {ahead.min():.0f} to {ahead.max():.0f} m ahead, "
        f"{max(-aside.min(), 0.0):.0f} m to port and {aside.max():.0f} m to starboard of the "
        "start. "
        "Wind and current come on top.",
        "",
        table(head, rows, head[1:]),
        "",
        "The last four columns are what the model expects at that time. Record all sensors from a "
        "minute before the first order to a minute after the last.",
        *([f"The model is {plan.outside.sentence}: keep more water than the table says."]
          if plan.outside.anywhere else []),
        "",
    ])  # fmt: skip


def _clock(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes}:{rest:02d}"
