"""What may be believed of a model, in sentences and a table: its coefficients, its residuals, and
whether it is better than another."""

from __future__ import annotations

import math
from collections.abc import Sequence

from shiplog.exceptions import listed
from shiplog.nomenclature.numbers import NINETY_SPREADS, counted, figure, percent
from shiplog.report.evaluation.text_table import table
from shiplog.simulation.better_model import Better
from shiplog.simulation.residual_tests import LEVEL, ResidualTest
from shiplog.training.physics.trust import (
    COMBINED,
    TRUSTED,
    UNMEASURED,
    VERDICTS,
    CoefficientTrust,
    alias_sentence,
)

MOST_NAMED = 12  # coefficients of one verdict in a sentence; the table has all
MOST_ALIASES = 4  # sentences on combinations; the table has all
INPUTS = {"wind_ahead": "wind from ahead", "wind_athwart": "wind from starboard"}


def coefficient_lines(
    run: str, judged: Sequence[CoefficientTrust], by: str = "by its training voyages"
) -> list[str]:
    """How many coefficients have each verdict, which, and what combinations are told apart."""
    if not judged:
        return []
    of = {verdict: [one for one in judged if one.verdict == verdict] for verdict in VERDICTS}
    lines = [f"Coefficients of {run}, {by}: {counts(judged)}."]
    for verdict in (TRUSTED, COMBINED, UNMEASURED):
        if of[verdict]:
            names = listed([one.name for one in of[verdict]], most=MOST_NAMED)
            lines.append(f"  {verdict}: {names}.")
    told = [alias_sentence(one, _error(one)) for one in of[COMBINED] if one.alias]
    lines += [f"  {sentence}." for sentence in told[:MOST_ALIASES]]
    return lines


def counts(judged: Sequence[CoefficientTrust]) -> str:
    """`30 trusted, 14 only in combination, 25 not measured`."""
    found = [one.verdict for one in judged]
    return ", ".join(f"{found.count(verdict)} {verdict}" for verdict in VERDICTS)


def _error(one: CoefficientTrust) -> float:
    """Its standard error, of its 90 % interval."""
    if one.high is None or one.low is None:
        return 0.0
    return 0.5 * (one.high - one.low) / NINETY_SPREADS


HEAD = (
    "coefficient", "what", "value", "90 % interval", "plausible before", "between voyages",
    "verdict", "why",
)  # fmt: skip


def cells(one: CoefficientTrust) -> tuple[str, ...]:
    """One row of the table, as HEAD."""
    interval = "-" if one.low is None or one.high is None else _span(one.low, one.high)
    between = "-" if one.between is None else figure(one.between)
    alias = alias_sentence(one, _error(one))
    why = f"{one.reason}; {alias}" if alias and one.verdict == COMBINED else one.reason
    return (
        one.name, f"{one.symbol}, {one.meaning}", figure(one.value, 3), interval,
        _span(*one.typical), between, one.verdict, why,
    )  # fmt: skip


def _span(low: float, high: float) -> str:
    return f"{figure(low)} to {figure(high)}"


def coefficients_table(judged: Sequence[CoefficientTrust]) -> str:
    return table(HEAD, [cells(one) for one in judged])


def sources(judged: Sequence[CoefficientTrust]) -> str:
    """Where the plausible ranges are from, in one sentence."""
    every = list(dict.fromkeys(one.source for one in judged))
    return f"Plausible before the fit, as 90 % ranges: {listed(every)}."


def residual_lines(run: str, tests: Sequence[ResidualTest]) -> list[str]:
    """Which tests of the residuals are rejected, strongest first; or that none is."""
    if not tests:
        return []
    rejected = sorted((one for one in tests if one.rejected), key=lambda one: -abs(one.correlation))
    head = (
        f"Residuals of {run} over one second, {counted(len(tests), 'test')} at a level of "
        f"{percent(LEVEL)} together"
    )
    if not rejected:
        return [f"{head}: they are white, and no input explains any of them."]
    coloured = [
        f"{_channel(one)} ({one.correlation:+.2f} after {one.lag_s:.0f} s)"
        for one in rejected if one.against == "whiteness"
    ]  # fmt: skip
    explained = [
        f"{_channel(one)} by {INPUTS.get(one.against, one.against)} ({one.correlation:+.2f} after "
        f"{one.lag_s:.0f} s)"
        for one in rejected if one.against != "whiteness"
    ]  # fmt: skip
    parts = [f"not white: {listed(coloured)}"] if coloured else []
    parts += [f"still explained: {listed(explained, most=6)}"] if explained else []
    return [f"{head}: {'; '.join(parts)}."]


def _channel(one: ResidualTest) -> str:
    return one.channel.replace("_", " ")


def better_lines(found: Sequence[Better]) -> list[str]:
    """P that one run is better than another on new voyages, in a sentence a pair."""
    return [better_sentence(one) for one in found]


def better_sentence(one: Better) -> str:
    first, second = one.a, one.b
    low, high, share = one.low, one.high, (one.share, one.share_low, one.share_high)
    elsewhere = (
        "Elsewhere it is not known: one of them was tested on no voyage before."
        if one.elsewhere is None
        else "Under conditions as unlike these as these are unlike those of its earlier tests it "
        f"is {_probability(one.elsewhere)}."
    )
    return (
        f"P({first} is better than {second} on new voyages like these) is "
        f"{_probability(one.probability)} ({_probability(low)} to {_probability(high)}): it has "
        f"{figure(share[0])} of its L ({figure(share[1])} to {figure(share[2])}), by "
        f"{counted(one.windows, 'window')} in {counted(one.blocks, 'block')}. {elsewhere}"
    )


def _probability(p: float) -> str:
    if not math.isfinite(p):
        return "-"
    return f"{min(max(p, 0.01), 0.99):.2f}"
