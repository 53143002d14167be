"""All limits of a file against an evaluation and a verdict."""

from __future__ import annotations

import fnmatch
from collections.abc import Iterable, Mapping, Sequence

from shiplog.models.causes import Cause
from shiplog.nomenclature.channels import STATE
from shiplog.report.evaluation.evaluation import Evaluation
from shiplog.report.gate import verdict_limits
from shiplog.report.gate.diagnosed import Diagnosed
from shiplog.report.gate.limits_file import Limits, given
from shiplog.report.gate.outcome import Measured, Outcome, of_number
from shiplog.report.gate.window_limits import KINDS, Scored, inside_band


def voyages_of(pattern: str, names: Iterable[str]) -> list[str]:
    """The tested voyages that a section [voyages.NAME] is about: the one of this name, else those
    that it fits as a shell pattern."""
    names = list(names)
    return [pattern] if pattern in names else [n for n in names if fnmatch.fnmatchcase(n, pattern)]


def of_windows(
    limits: Limits, names: Sequence[str], found: Evaluation | None, lacking: str
) -> list[Outcome]:
    """Those of [simulation], [voyages] and [band].

    found     the evaluation of the run; None where there is no window
    lacking   why there is none
    """
    lines = _of_scored(
        "simulation", "", limits.window_s, given(limits.simulation),
        None if found is None else Scored.of(found), lacking,
    )  # fmt: skip
    for pattern, section in limits.voyages.items():
        for name in voyages_of(pattern, names):
            scored = None if found is None else Scored.of(found, name)
            why = lacking or f"{name} has no {limits.window_s} s without a gap"
            lines += _of_scored(
                f"voyages.{name}", f"{name}, ", limits.window_s, given(section), scored, why
            )
    wanted = given(limits.band)
    for channel in STATE:
        if channel.name in wanted:
            share = Measured(reason=lacking) if found is None else inside_band(found, channel.name)
            words = f"share of {channel.name.replace('_', ' ')} inside its band"
            lines.append(
                of_number("band", channel.name, words, "", wanted[channel.name], share, True)
            )
    return lines


def _of_scored(
    section: str, before: str, seconds: int, wanted: Mapping[str, float], scored: Scored | None,
    lacking: str,
) -> list[Outcome]:  # fmt: skip
    return [
        of_number(
            section, kind.key, before + kind.words.format(window=seconds), kind.unit,
            wanted[kind.key], Measured(reason=lacking) if scored is None else kind.measure(scored),
            kind.at_least,
        )
        for kind in KINDS
        if kind.key in wanted
    ]  # fmt: skip


def of_verdict(
    limits: Limits, found: Diagnosed, own: Sequence[Cause] = (), windless: bool = False
) -> list[Outcome]:
    """Those of [diagnosis] and [sizes].

    own       causes of the user's own
    windless  whether the model has no wind force
    """
    lines = []
    if limits.diagnosis.allowed:
        lines.append(verdict_limits.of_verdict(limits.diagnosis.allowed, found))
    if limits.diagnosis.causes_allowed is not None:
        lines.append(verdict_limits.of_named(limits.diagnosis.causes_allowed, found))
    lines += [
        verdict_limits.of_cause(label, found) for label in limits.diagnosis.causes_not_allowed or ()
    ]
    lines += [
        verdict_limits.of_size(label, parameter, limit, found, own, windless)
        for label, sizes in limits.sizes.items()
        for parameter, limit in sizes.items()
    ]
    return lines
