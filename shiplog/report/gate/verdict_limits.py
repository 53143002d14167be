"""Limits on a verdict: which are allowed, which causes are not, and how large one may be.

A cause that is not named is assessed only where it could have shown. A limit on its size then holds
where its smallest detectable size is not above the limit: a larger one would have been found.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

from shiplog.models.causes import Cause
from shiplog.nomenclature.numbers import figure
from shiplog.report.gate.cause_names import SEARCHED, SIDE_THRUST, neutral, parted, unit_of
from shiplog.report.gate.diagnosed import Detectable, Diagnosed, Named, fits
from shiplog.report.gate.outcome import Measured, Outcome, of_number

OPEN = ("undecided", "coverage")  # verdicts that decide nothing
UNDECIDED = {
    "undecided": "no answer has a probability of 0.9",
    "coverage": "there are too little data, or they are outside the training data",
}


def of_verdict(allowed: Sequence[str], found: Diagnosed) -> Outcome:
    """Whether the verdict is one of those allowed. One that decides nothing is not assessed."""
    word = found.verdict
    state = "holds" if word in allowed else "not assessed" if word in OPEN else "broken"
    reason = UNDECIDED[word] if state == "not assessed" else ""
    return Outcome(
        "diagnosis", "allowed", "verdict", "allowed", tuple(allowed), "",
        Measured(words=word, reason=reason), state,
    )  # fmt: skip


def of_named(allowed: Sequence[str], found: Diagnosed) -> Outcome:
    """Whether no other causes are named than those allowed. Where nothing is decided, nothing is
    named either, and that was not assessed."""
    other = [one for one in found.causes if not any(fits(a, one.name, one.part) for a in allowed)]
    words = ", ".join(f"{c.name}:{c.part}" if c.part else c.name for c in found.causes) or "none"
    state, reason = "holds", ""
    if other:
        state, reason = "broken", other[0].sentence
    elif why := _open(found):
        state, reason = "not assessed", why
    return Outcome(
        "diagnosis", "causes_allowed", "named causes", "allowed", tuple(allowed) or ("none",), "",
        Measured(words=words, reason=reason), state,
    )  # fmt: skip


def of_cause(label: str, found: Diagnosed) -> Outcome:
    """Whether a cause that is not allowed is named."""
    state, measured = "holds", Measured(words="not named")
    if named := found.named(label):
        state, measured = "broken", Measured(words="named", reason=named[0].sentence)
    elif label == SIDE_THRUST:  # it has no smallest detectable size
        if why := _open(found) or _untested(found):
            state, measured = "not assessed", Measured(reason=why)
    elif not found.traced(label) and (why := found.not_excluded(label)):
        state, measured = "not assessed", Measured(reason=why)
    return Outcome(
        "diagnosis", "causes_not_allowed", label, "not allowed", None, "", measured, state
    )


def of_size(
    label: str, parameter: str, limit: float, found: Diagnosed, own: Sequence[Cause] = (),
    windless: bool = False,
) -> Outcome:  # fmt: skip
    """The size of a number of a cause: how far it is from its value where the cause is absent.

    Of a cause that is named, or is a trace, it is the far end of the 90 % interval that counts: the
    largest size that these data leave possible. Of one that is not, it is the smallest detectable
    size.
    """
    unit = unit_of(label, parameter, own)
    at = neutral(label, parameter, own, windless)
    if present := [*found.named(label), *found.traced(label)]:
        measured = _largest([size_of(one, parameter, at) for one in present])
        why = _not_shown(label, parameter, limit, unit, found, {one.part for one in present})
        if why and measured.high is not None and measured.high <= limit:
            measured = Measured(reason=why)
    else:
        measured = _not_named(label, parameter, limit, unit, found)
    key = f"{label}.{parameter}"
    return of_number("sizes", key, key, unit, limit, measured, far_end=True)


def size_of(one: Named, parameter: str, at: float) -> Measured:
    """How far a number of a cause, and the ends of its interval, are from `at`."""
    number = one.parameters.get(parameter)
    if number is None:
        known = ", ".join(one.parameters)
        return Measured(reason=f"{one.name} is named, and has no {parameter} (it has {known})")
    ends = [v - at for v in (number.low, number.high, number.value) if isinstance(v, float)]
    if len(ends) < 3:
        return Measured(reason=f"{one.name} is named, and its {parameter} is not known")
    low, high, value = ends
    nearest = 0.0 if low <= 0.0 <= high else min(abs(low), abs(high))
    return Measured(abs(value), nearest, max(abs(low), abs(high)), reason=one.sentence)


def _largest(each: Sequence[Measured]) -> Measured:
    """The largest; not assessed where one is not, unless another is known."""
    known = [one for one in each if one.value is not None]
    return max(known, key=lambda one: one.high or 0.0) if known else each[0]


def _not_named(label: str, parameter: str, limit: float, unit: str, found: Diagnosed) -> Measured:
    why = found.not_excluded(label) or _not_shown(label, parameter, limit, unit, found)
    if why:
        return Measured(reason=why)
    least = max(detectable_size(one, parameter) or 0.0 for one in found.detectable(label))
    return Measured(least, words=f"not found (detectable from {_told(least, unit)})")


def _not_shown(
    label: str, parameter: str, limit: float, unit: str, found: Diagnosed,
    named: Collection[str] = (),
) -> str:  # fmt: skip
    """Why a size above the limit might not have shown, of a channel or unit of the cause that is
    not among those `named`; empty where it would have."""
    for one in found.detectable(label):
        if one.part in named:
            continue
        of = f" of {one.part}" if one.part and one.part not in label else ""
        size = detectable_size(one, parameter)
        if size is None:
            return f"no realistic {parameter}{of} could have shown"
        if size > limit:
            return f"not found{of}, and only {_told(size, unit)} or more could have shown"
    return ""


def _told(size: float, unit: str) -> str:
    return f"{figure(size, 3)} {unit}".rstrip()


def detectable_size(one: Detectable, parameter: str) -> float | None:
    """The smallest detectable size of a number; of several that it is searched by, the largest."""
    searched = SEARCHED.get((parted(one.name)[0], parameter), (parameter,))
    sizes = [one.parameters[key].value for key in searched if key in one.parameters]
    known = [abs(v) for v in sizes if isinstance(v, float)]
    return max(known) if len(known) == len(searched) else None


def _open(found: Diagnosed) -> str:
    return UNDECIDED.get(found.verdict, "")


def _untested(found: Diagnosed) -> str:
    why = [one.reason for one in found.unavailable if one.name == SIDE_THRUST]
    return f"it could not be tested: {'; '.join(why)}" if why else ""
