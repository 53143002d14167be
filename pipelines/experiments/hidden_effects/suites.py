"""The suites: which seeds, and what is hidden in each. All of a case follows from its seed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from importlib import import_module

import numpy as np

from pipelines.experiments.hidden_effects.parameters import ABSORBED, SURVIVE
from pipelines.experiments.hidden_effects.plan import Plan, Planned
from pipelines.experiments.simulated_ship.cases import CATALOGUE, DEVICES, OUTSIDE
from shiplog.exceptions import ShiplogError

Rule = Callable[[int, int], str]  # seed, number in the row → cause


def _pair(seed: int, number: int) -> str:
    """Two different names of the catalogue, drawn evenly by the seed; no pair is left out."""
    names = tuple(CATALOGUE)
    drawn = np.random.default_rng([seed, *b"two at once"]).choice(len(names), 2, replace=False)
    return "+".join(names[i] for i in sorted(drawn))


UNNAMED = ("propeller_side_force", "turbulence")  # what no cause has a name for by now


def _with_device(seed: int, number: int) -> str:
    """One name of the catalogue, and one actuator or line."""
    rng = np.random.default_rng([seed, *b"one and a device"])
    return "+".join(str(rng.choice(tuple(names))) for names in (CATALOGUE, DEVICES))


STRIDE = 8  # has no factor in common with the 21 causes
RULES: dict[str, Rule] = {
    "none": lambda seed, number: "none",
    # each equally often, and of every kind some before a row is half done
    "one": lambda seed, number: tuple(CATALOGUE)[STRIDE * number % len(CATALOGUE)],
    "two": _pair,
    "outside": lambda seed, number: tuple(OUTSIDE)[number % len(OUTSIDE)],
    "device": lambda seed, number: tuple(DEVICES)[number % len(DEVICES)],
    "next device": lambda seed, number: tuple(DEVICES)[(number + 7) % len(DEVICES)],
    "unnamed": lambda seed, number: UNNAMED[number % len(UNNAMED)],
    "with device": _with_device,
}
GOALS: tuple[tuple[str, float | None, int], ...] = (  # rule, size, seconds of the trial
    ("one", 1.0, 7000),
    ("one", 0.3, 7000),
    ("one", 1.0, 500),
    ("none", None, 7000),
    ("outside", 1.0, 7000),
    ("two", 1.0, 7000),
)
# The same with actuators, lines, tows and contact, of which a third of the cases are.
DEVICE_GOALS: tuple[tuple[str, float | None, int], ...] = (
    ("one", 1.0, 7000),
    ("device", 1.0, 7000),
    ("next device", 1.0, 7000),
    ("none", None, 7000),
    ("unnamed", 1.0, 7000),
    ("with device", 1.0, 7000),
)
ROWS = {"goals": GOALS, "devices": DEVICE_GOALS}
SUITES = {  # name → (first seed, cases; of `goals` and `devices`: of each row)
    "fixed": (1001, 12),  # the first twelve after 1000, and none, one, two, outside all occur
    # The same ships and effects, of realistic size, in campaigns of 3000 s: minutes. A tenth of
    # that does not show in so short a campaign.
    "brief": (1001, 12),
    "nightly": (30000, 200),  # never tuned on: shift the block monthly
    "goals": (20000, 20),
    "network": (25000, len(SURVIVE) + len(ABSORBED)),
    "abroad": (70000, 100),
    # never tuned on
    "devices": (64000, 20),
    "devices-abroad": (74000, 120),
}
# Ships whose equations are not the home ship's, in turn.
FAMILIES = ("abkowitz", "linear_dp", "catamaran", "azimuth_ferry", "shipmmg")
SHARES: tuple[tuple[str, float | None, int], ...] = (  # rule, size, cases of twenty
    ("one", 1.0, 6), ("none", None, 5), ("outside", 1.0, 5), ("one", 0.3, 2), ("two", 1.0, 2),
)  # fmt: skip
# The same with two ships that heel, and with actuators, lines, tows and contact.
MORE_FAMILIES = (*FAMILIES, "container", "naval_vessel")
DEVICE_SHARES: tuple[tuple[str, float | None, int], ...] = (  # rule, size, cases of 24
    ("one", 1.0, 5), ("actuators", 1.0, 6), ("lines", 1.0, 3), ("none", None, 4),
    ("unnamed", 1.0, 2), ("one", 0.3, 1), ("with device", 1.0, 3),
)  # fmt: skip


def plan(suite: str, first_seed: int | None = None, count: int | None = None) -> Plan:
    """The rows of `goals`, and of `devices`, share their seeds: the same ships, weather and noise
    in each."""
    first, number = SUITES[suite]
    first = first if first_seed is None else first_seed
    number = number if count is None else count
    seeds = range(first, first + number)
    if suite == "abroad":
        return Plan(suite, first, abroad(seeds))
    if suite == "devices-abroad":
        return Plan(suite, first, devices_abroad(seeds))
    if suite == "network":
        causes = (*SURVIVE, *ABSORBED)
        return Plan(suite, first, tuple(
            Planned(str(s), s, causes[(s - first) % len(causes)], 1.0, 7000, "feedforward")
            for s in seeds
        ))  # fmt: skip
    if suite not in ROWS:
        size, seconds = (1.0, 3000) if suite == "brief" else (None, 7000)
        return Plan(suite, first, tuple(Planned(str(s), s, None, size, seconds) for s in seeds))
    return Plan(suite, first, tuple(
        Planned(f"{seed}-{row}", seed, RULES[rule](seed, seed - first), size, seconds)
        for seed in seeds
        for row, (rule, size, seconds) in enumerate(ROWS[suite], 1)
    ))  # fmt: skip


def abroad(seeds: Sequence[int]) -> tuple[Planned, ...]:
    """Cases of other families, a seed each; its label, the seed, does not say the row.

    Every twenty cases, counted from the first seed, have the shares of `SHARES`, and every hundred
    have them within each family. Which case has which row is drawn by the first seed. Raises
    ShiplogError where the simulator of these families is not installed.
    """
    offered, outside = _simulator()
    rows = [(rule, size) for rule, size, cases in SHARES for _ in range(cases)]
    order = np.random.default_rng([seeds[0], *b"abroad"]).permutation(len(rows))
    step = len(rows) // len(FAMILIES)
    met: dict[tuple[str, str, float | None], int] = {}  # cases so far of family, rule and size
    cases = []
    for number, seed in enumerate(seeds):
        turn, which = divmod(number, len(FAMILIES))
        family = FAMILIES[which]
        rule, size = rows[order[(turn + which * step) % len(rows)]]
        count = met[family, rule, size] = met.get((family, rule, size), -1) + 1
        causes = _in_turn(seeds[0], family, rule, size, offered(family), outside)
        turned = [causes[(count + i) % len(causes)] for i in range(len(causes))]
        own = set(offered(family, seed))  # this ship may lack what another one has
        fitting = (one for one in turned if own.issuperset(one.split("+")))
        cause = "none" if rule == "none" else next(fitting, turned[0])
        cases.append(Planned(str(seed), seed, cause, size, 7000, family=family))
    return tuple(cases)


def devices_abroad(seeds: Sequence[int]) -> tuple[Planned, ...]:
    """Cases of all families in turn; every 24 cases, counted from the first seed, have the shares
    of `DEVICE_SHARES`. Otherwise as `abroad`."""
    offered, outside = _simulator()
    devices_of = import_module("pipelines.experiments.other_families").devices_of
    rows = [(rule, size) for rule, size, cases in DEVICE_SHARES for _ in range(cases)]
    order = np.random.default_rng([seeds[0], *b"devices abroad"]).permutation(len(rows))
    met: dict[tuple[str, str, float | None], int] = {}
    cases = []
    for number, seed in enumerate(seeds):
        family = MORE_FAMILIES[number % len(MORE_FAMILIES)]
        rule, size = rows[order[number % len(rows)]]
        count = met[family, rule, size] = met.get((family, rule, size), -1) + 1
        plain = [name for name in offered(family, seed) if name not in outside]
        causes = _of_rule(rule, plain, devices_of(family, seed), offered(family, seed))
        drawn = np.random.default_rng([seeds[0], *f"{family} {rule} {size}".encode()])
        # of this ship: another one of the family may offer a few more
        ranked = [causes[i] for i in drawn.permutation(len(causes))]
        cause = ranked[count % len(ranked)]
        cases.append(Planned(str(seed), seed, cause, size, 7000, family=family))
    return tuple(cases)


def _of_rule(
    rule: str, plain: Sequence[str], devices: Sequence[str], offered: Sequence[str]
) -> list[str]:
    """What a row of `devices_abroad` hides."""
    acting = [name for name in devices if name.startswith("actuator")]
    if rule == "with device":
        return [f"{one}+{other}" for one in plain for other in devices]
    return {
        "one": list(plain), "actuators": acting, "none": ["none"],
        "lines": [name for name in devices if name not in acting],
        "unnamed": [name for name in UNNAMED if name in offered],
    }[rule]  # fmt: skip


def _in_turn(
    first: int, family: str, rule: str, size: float | None, offered: Sequence[str],
    outside: Sequence[str],
) -> list[str]:  # fmt: skip
    """What this row hides on this family, in an order drawn once; all of it before any twice."""
    if rule == "outside":  # where a family cannot hide all of them it says which
        names = [name for name in outside if name in offered] or list(outside)
    else:
        names = [name for name in offered if name not in outside]
    if rule == "two":  # `thrust_loss` and `thrust_loss:unit` are one name
        names = [
            f"{a}+{b}" for i, a in enumerate(names) for b in names[i + 1 :]
            if a.partition(":")[0] != b.partition(":")[0]
        ]  # fmt: skip
    drawn = np.random.default_rng([first, *f"{family} {rule} {size}".encode()])
    return [names[i] for i in drawn.permutation(len(names))]


def _simulator() -> tuple[Callable[..., tuple[str, ...]], tuple[str, ...]]:
    """(Family, seed) → causes that this ship can hide, and what of them is in no catalogue."""
    try:
        simulator = import_module("pipelines.experiments.other_families")
        return simulator.offered, tuple(simulator.OUTSIDE)
    except (ImportError, AttributeError) as error:
        raise ShiplogError(
            "The simulator of other families, pipelines.experiments.other_families, is not here "
            f"({error}).",
            hint="run the suite `abroad` from a checkout that has it.",
        ) from error
