"""The verdict in words."""

from __future__ import annotations

import math
from collections.abc import Sequence

from shiplog.diagnosis import thresholds
from shiplog.diagnosis.verdict.result import EXPLAIN_MORE, PATTERN, REFUTED, SIDE_THRUST
from shiplog.exceptions import listed
from shiplog.nomenclature.numbers import counted, percent
from shiplog.report.diagnosis.sections.causes import NamedCause
from shiplog.report.diagnosis.sections.limits import NONE_TESTED, NotShown
from shiplog.report.diagnosis.sections.ranking import Ranked
from shiplog.report.diagnosis.sections.structure import Structure
from shiplog.report.diagnosis.sections.wrong import ChannelError
from shiplog.simulation.error_reduction import Gain

NOTED_NOISE = 1.15  # times the nominal process noise, from which "no change" mentions it
MOST_HIDDEN = 8  # names of causes that could not have shown; the others are counted
SAME_ERROR = 0.0005  # share of the error: a smaller change would be written as 0.0 %
OTHER_EQUATIONS = (
    "Either the equations of the catalogue are not those of this ship, or something unknown acts."
)


def sentence(
    verdict: str,
    causes: Sequence[NamedCause],
    structure: Structure | None,
    gain: Gain | None,
    noise_factor: float,
    alone: float | None = None,
    ranking: Sequence[Ranked] = (),
    wrong: Sequence[ChannelError] = (),
    one_of: Sequence[str] = (),
    either: Sequence[str] = (),
    why: str = "",
    hidden: NotShown = NONE_TESTED,
) -> str:
    """The verdict in a few sentences: the share of the error that is explained, then the causes.

    noise_factor  factor of the process noise on its nominal standard deviation
    alone   share of the error that a second fit without any cause removes; None without that fit
    wrong   share of the error in each channel, before any cause is included
    one_of  names of which one acts in addition
    either  names that act, or else the structure does
    why     an undecided verdict is, as of `Decision`
    hidden  how many causes could not have shown, as of `limits.not_shown`
    """
    if verdict == "named":
        named = _named(causes, gain, alone, wrong)
        return f"{named} {_in_addition(one_of, ranking)}".strip()
    if verdict == "undecided" and why:
        assert structure is not None
        return _either(either or (SIDE_THRUST,), structure, ranking, why)
    if verdict == "undecided":
        stated = [one for one in ranking if one.probability >= thresholds.STATED]
        text = [
            f"{_answer(one.name)} ({_likelihood(one.probability)})" for one in stated or ranking[:3]
        ]
        if stated:
            return (
                f"Undecided: the log Bayes factor favours {' and '.join(text)}, which held-out "
                "voyages do not confirm."
            )
        least = f"{thresholds.STATED:.0%}"
        undecided = f"Undecided: {' or '.join(text)}. No answer has a probability of {least}."
        first = ranking[0].name if ranking else ""
        return f"{undecided} {_hidden(hidden)}".strip() if first == "none" else undecided
    if verdict == "unknown":
        assert structure is not None
        return _unknown(structure, noise_factor)
    if verdict == "coverage":
        return "Not trained in these conditions: record data there first, then diagnose again."
    if verdict == "external":
        return "The ship was pushed, held or towed: no force of its own explains these stretches."
    text = (
        "No change found: the errors are those that the model already has on its nominal voyages."
    )
    text = f"{text} {_hidden(hidden)}".strip()
    if noise_factor < NOTED_NOISE:
        return text
    return (
        f"{text} Process noise is {noise_factor:.1f} times its nominal standard deviation: no more "
        "than it varies."
    )


def _hidden(hidden: NotShown) -> str:
    """How many causes no change can be said of, and which."""
    if not hidden.of:
        return ""
    if not hidden.causes:
        return f"Each of {hidden.of} causes could have shown."
    which = listed((name.replace("_", " ") for name in hidden.names), most=MOST_HIDDEN)
    return f"{hidden.causes} of {hidden.of} causes could not have shown: {which}."


def _named(
    causes: Sequence[NamedCause],
    gain: Gain | None,
    alone: float | None,
    wrong: Sequence[ChannelError],
) -> str:
    text = " ".join(_likely(cause) for cause in causes)
    if gain is None:
        return text
    windows = counted(gain.windows, "held-out window")
    if max(map(abs, (gain.reduction, gain.low, gain.high))) < SAME_ERROR:
        share = f"The error on {windows} stays the same."
    elif gain.real:
        share = (
            f"{percent(gain.reduction)} of the error on {windows} is "
            f"explained ({percent(gain.low)} to {percent(gain.high)})."
        )
    else:
        share = (
            f"No significant part of the error on {windows} is explained: "
            f"it is {less(gain.reduction)} ({less(gain.low)} to {less(gain.high)})."
        )
    text = " ".join(part for part in (share, text, _left(gain, wrong)) if part)
    if alone is None:
        return text
    return f"{text} Fitted again with nothing named, the model has an error {less(alone)}."


def _either(names: Sequence[str], structure: Structure, ranking: Sequence[Ranked], why: str) -> str:
    """Causes, or something that is not in the catalogue and does much of the same."""
    likely = {one.name: one.probability for one in ranking}
    outside = f"unknown:{structure.family}"
    causes = listed(map(_answer, names))
    reasons = {
        EXPLAIN_MORE: f"Both together explain most, and alone {causes} more. {OTHER_EQUATIONS}",
        REFUTED: (
            f"The log Bayes factor favours {causes}, and held-out voyages refute "
            f"{'it' if len(names) == 1 else 'them'}. "
            f"{OTHER_EQUATIONS}"
        ),
        PATTERN: (
            "A side force comes and goes: less clearly on or off than one device is, and more "
            "clearly than a force that varies."
        ),
    }
    return (
        f"Undecided: {causes} ({_likelihood(likely.get(names[0], 0.0))}), or {_answer(outside)} "
        f"({_likelihood(likely.get(outside, 0.0))}). {reasons[why]}"
    )


def _in_addition(one_of: Sequence[str], ranking: Sequence[Ranked]) -> str:
    """One cause more, of which only these are left."""
    if not one_of:
        return ""
    likely = {one.name: one.probability for one in ranking}
    text = " or ".join(f"{_answer(name)} ({_likelihood(likely.get(name, 0.0))})" for name in one_of)
    return f"By the log Bayes factor, {text} acts as well: these data cannot tell which."


def _unknown(structure: Structure, noise_factor: float) -> str:
    if structure.family == "intermittent":
        return (
            "Outside the catalogue: an intermittent side force acts on the ship, and no device "
            "of known place and pattern explains it."
        )
    if structure.family == "stochastic":
        return (
            f"Outside the catalogue: process noise is {noise_factor:.1f} times its nominal "
            "standard deviation, and no cause explains that."
        )
    return (
        f"Outside the catalogue: it acts on {listed(structure.acts_on)} and depends on "
        f"{listed(structure.depends_on)}."
    )


def _left(gain: Gain, wrong: Sequence[ChannelError]) -> str:
    """The channel with the largest part of the error that the causes leave; empty without one."""
    left = {
        one.channel: one.share_of_error * (1.0 - gain.channels.get(one.channel, 0.0))
        for one in wrong
    }
    if not left:
        return ""
    channel, share = max(left.items(), key=lambda pair: pair[1])
    where = channel.replace("_", " ")
    return f"The largest unexplained part is in {where}: {percent(share)} of the error."


def _answer(name: str) -> str:
    """One entry of the ranking, in words."""
    if name == "none":
        return "no change"
    if name.startswith("unknown:"):
        return f"something outside the catalogue ({name.partition(':')[2]})"
    return name.replace("_", " ")


def _likelihood(probability: float) -> str:
    """In whole per cent; what is below `thresholds.STATED` is not rounded up to it."""
    if probability < thresholds.STATED <= round(probability, 2):
        return f"{math.floor(100.0 * probability)}%"
    return f"{probability:.0%}"


def _likely(cause: NamedCause) -> str:
    """A cause's sentence, with its probability where that is below `thresholds.STATED`."""
    if cause.probability >= thresholds.STATED:
        return _or(cause)
    how = "Likely" if cause.probability > 0.5 else "Perhaps"
    return f"{how} ({_likelihood(cause.probability)}): {_or(cause)}"


def _or(cause: NamedCause) -> str:
    """A cause's sentence, with the causes that these data cannot tell from it."""
    others = cause.indistinguishable_from
    if not others:
        return cause.sentence
    return f"{cause.sentence.removesuffix('.')}; or it is {listed(others)}: these data cannot tell."


def less(share: float) -> str:
    """A relative reduction of the error, in words; a negative one is an increase."""
    return f"{abs(share):.1%} {'less' if share >= 0.0 else 'more'}"
