"""A verdict as a limit needs it: read from `verdict.json`, or of a diagnosis of today."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from pydantic import BaseModel, ConfigDict

from shiplog.report.diagnosis.answer import LEAST_CANDIDATE
from shiplog.report.diagnosis.sections.causes import WHICH
from shiplog.report.diagnosis.sections.limits import HOPELESS
from shiplog.report.gate.cause_names import parted


class Part(BaseModel):
    """Frozen. Of an answer's keys those that limits need; the others are left."""

    model_config = ConfigDict(frozen=True, extra="ignore")


class Number(Part):
    """A parameter with its 90 % interval, or its smallest detectable change."""

    value: float | str | None
    low: float | str | None = None
    high: float | str | None = None
    unit: str = ""


class Named(Part):
    """A cause that was named, or is present below its practical size."""

    name: str
    parameters: dict[str, Number] = {}
    sentence: str = ""
    indistinguishable_from: tuple[str, ...] = ()

    @property
    def part(self) -> str:
        """Its channel or actuator; empty where it has none."""
        found = [self.parameters[key].value for key in WHICH if key in self.parameters]
        return str(found[0]) if found else ""


class Detectable(Part):
    """The smallest detectable sizes of a cause; `share` is of its realistic size."""

    name: str
    share: float | None = None
    parameters: dict[str, Number] = {}
    channel: str | None = None
    actuator: str | None = None

    @property
    def part(self) -> str:
        return self.channel or self.actuator or ""

    @property
    def hopeless(self) -> bool:
        """Whether no realistic size could have shown."""
        return self.share is None or self.share >= HOPELESS


class Ranked(Part):
    name: str
    probability: float


class Untested(Part):
    name: str
    reason: str


class Base(Part):
    run: str


class Diagnosed(Part):
    """The keys of `verdict.json` that limits need."""

    contract: int
    verdict: str
    sentence: str
    base: Base
    causes: tuple[Named, ...] = ()
    traces: tuple[Named, ...] = ()
    ranking: tuple[Ranked, ...] = ()
    limits: tuple[Detectable, ...] = ()
    unavailable: tuple[Untested, ...] = ()

    def named(self, label: str) -> list[Named]:
        """The named causes that a limit on `label` is about."""
        return [one for one in self.causes if fits(label, one.name, one.part)]

    def traced(self, label: str) -> list[Named]:
        """The causes that are present, but below their practical size."""
        return [one for one in self.traces if fits(label, one.name, one.part)]

    def detectable(self, label: str) -> list[Detectable]:
        """What could have shown of the causes that a limit on `label` is about: where one of them
        is of no channel, as `heading_offset` is, it is that one."""
        found = [one for one in self.limits if fits(label, one.name, one.part)]
        return [one for one in found if not one.part] or found

    def not_excluded(self, label: str) -> str:
        """Why the verdict does not say that a cause, which is not named, is absent; else empty."""
        return next(self._reasons(label), "")

    def _reasons(self, label: str) -> Iterator[str]:
        name, part = parted(label)
        same = [one for one in self.causes if one.name == name]
        for one in self.causes:
            if name in one.indistinguishable_from:
                yield f"these data cannot tell it from {one.name}, which is named"
        for one in self.ranking:
            if one.name == name and one.probability >= LEAST_CANDIDATE and not same:
                yield f"it is not excluded: its probability is {one.probability:.2f}"
        found = self.detectable(label)
        untested = [one.reason for one in self.unavailable if one.name == name]
        if part:
            untested = [why for why in untested if why.startswith(f"{part}: ")]
        if untested and not any(not one.part for one in found):
            yield f"it could not be tested: {'; '.join(untested)}"
        if not found:
            yield f"it was not tested: the verdict is {self.verdict}"
        if any(one.hopeless for one in found):
            yield "no realistic size of it could have shown in these data"


def fits(label: str, name: str, part: str) -> bool:
    """Whether `label` of a limit is about a cause: `clock_offset` is, of each channel of it."""
    cause, wanted = parted(label)
    return cause == name and (not wanted or wanted == part)


def of(answer: Mapping[str, Any]) -> Diagnosed:
    """Raises pydantic.ValidationError where it is no answer of `diagnose`."""
    return Diagnosed.model_validate(answer)
