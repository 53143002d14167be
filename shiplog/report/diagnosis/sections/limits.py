"""The smallest size of each cause that these data would reveal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from shiplog.diagnosis import thresholds
from shiplog.diagnosis.verdict.result import Decision
from shiplog.models.causes import Cause, Setting, si
from shiplog.nomenclature.numbers import figure, percent
from shiplog.report.evaluation.text_table import table
from shiplog.report.figures.bars import HOPELESS


@dataclass(frozen=True, slots=True)
class Size:
    """A change of a parameter in its unit."""

    value: float
    unit: str


@dataclass(frozen=True, slots=True)
class Limit:
    """Smallest detectable size of each cause, best determined first.

    share       of its realistic size, all numbers together
    parameters  of each number alone, with `value`, `unit`; undetectable ones are left out
    channel     of which channel, where it is tested for each
    actuator    of which unit, where it is tested for each
    """

    name: str
    share: float
    parameters: Mapping[str, Size]
    channel: str | None = None
    actuator: str | None = None

    @property
    def label(self) -> str:
        which = self.channel or self.actuator
        return f"{self.name} ({which})" if which else self.name


@dataclass(frozen=True, slots=True)
class NotShown:
    """How many causes no realistic size could have shown.

    causes  their number
    of      all in `limits`
    """

    causes: int = 0
    of: int = 0
    names: tuple[str, ...] = ()


NONE_TESTED = NotShown()


def of(decision: Decision, causes: Sequence[Cause], setting: Setting) -> tuple[Limit, ...]:
    by, nats = {c.label: c for c in causes}, thresholds.SHOWS_NATS
    found = []
    for label, expected in decision.expected.items():
        cause, least = by[label], expected.least(nats)
        if cause.special:
            continue
        sizes = least * cause.sizes(setting)
        if cause.parameters:  # its sizes begin with theirs; uncertain factors may follow
            parts = zip(cause.parameters, sizes, least, strict=False)
            numbers = {p.name: (v / si(p.unit), p.unit) for p, v, of in parts if of < HOPELESS}
        else:  # a number for each rudder, or for each point of the map
            numbers = cause.displayed(sizes)
        parameters = {k: Size(float(v), unit) for k, (v, unit) in numbers.items()}
        part = label.partition(":")[2] or None
        of_actuator = bool(getattr(cause, "actuator", "")) and not getattr(cause, "channel", "")
        found.append(
            Limit(
                cause.name, expected.common_size(nats), parameters,
                None if of_actuator else part, part if of_actuator else None,
            )
        )  # fmt: skip
    return tuple(sorted(found, key=lambda one: one.share))


def not_shown(limits: Sequence[Limit]) -> NotShown:
    names = tuple(one.label for one in limits if one.share >= HOPELESS)
    return NotShown(len(names), len(limits), names)


def markdown(limits: Sequence[Limit]) -> list[str]:
    if not limits:
        return []
    rows = []
    for one in limits:
        numbers = ", ".join(
            f"{k.replace('_', ' ')} {_change(v)}" for k, v in one.parameters.items()
        )
        share = percent(one.share) if one.share < HOPELESS else "not detectable"
        rows.append((one.label, numbers, share))
    share = "of realistic size"
    return [
        "## Smallest detectable sizes", "",
        "A cause below this size may be present and not found: the change of each number alone, "
        "and all numbers together as a share of the realistic size.", "",
        table(("cause", "detectable from", share), rows, (share,)), "",
    ]  # fmt: skip


def _change(size: Size) -> str:
    """A size in its unit; in per cent where it has none."""
    return (
        f"{figure(100 * size.value)}%" if size.unit == "1" else f"{figure(size.value)} {size.unit}"
    )
