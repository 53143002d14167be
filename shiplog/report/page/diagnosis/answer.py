"""What, how sure, how big, what to do, what would have been missed: the first screen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from shiplog.diagnosis.thresholds import STATED
from shiplog.exceptions import listed
from shiplog.nomenclature.numbers import counted, percent
from shiplog.report.diagnosis.sections.subject import MOST_VOYAGES, dates
from shiplog.report.figures.bars import size_in_words, spoken
from shiplog.report.page.blocks import Answers, Block, Line, number, probability, share
from shiplog.report.page.diagnosis import considered
from shiplog.report.page.diagnosis.source import Source

MOST_MISSED = 4  # causes that are listed on the first screen; the others are counted

# Verdict → what its owner is to do. Of a verdict `named`, each cause has its own.
TO_DO = {
    "none": "Nothing: the model errs as it does on its own voyages. Go on with it, within what "
    "would have been missed.",
    "undecided": "Sail the test below that separates the candidates, then diagnose again. Do not "
    "change the model yet.",
    "unknown": "Do not add a cause of the catalogue to the model. Look for what acts as said here, "
    "or write it as a cause of your own.",
    "coverage": "Record voyages in these conditions, train again, then diagnose again.",
    "external": "Leave these stretches out, or record what pushed the ship there.",
}
CALIBRATED = "On simulated ships nine in ten of the answers that were given with 0.9 were right."
NONE_STATED = "An answer is named from 0.9 on: on simulated ships nine in ten were right there."
NOT_FAVOURED = (
    "The rest is with causes that these voyages do not favour, and do not exclude either."
)
SEPARATES = "A test that separates"  # begins the note of it
NO_TEST = (
    "Do not change the model yet: it is not known which of these acts. No test that would separate "
    "them is known; record longer voyages, with more different manoeuvres."
)


def claim(source: Source) -> str:
    """The answer with its scope, in one sentence."""
    verdict, subject = source.verdict, source.subject
    run = subject["run"]
    on = f"On {names_of(source)}"
    word = verdict["verdict"]
    if word == "named":
        causes = " and ".join(spoken(c["name"], _of(c)) for c in verdict["causes"])
        if not (gain := verdict.get("gain")):
            return f"{on}, the simulation by {run} lacks {causes}."
        held = counted(gain["held_out_windows"], "held-out window")
        verb = "explains" if len(verdict["causes"]) == 1 else "explain"
        return (
            f"{_begun(causes)} {verb} {percent(max(gain['reduction'], 0.0))} of the "
            f"error of the simulation by {run} on {held} of {names_of(source)}."
        )
    if word == "none":
        return f"{on}, the simulation by {run} errs no more than on the voyages it was made of."
    if word == "undecided" and len(verdict["ranking"]) > 1:
        first = " or ".join(spoken(one["name"]) for one in verdict["ranking"][:3])
        return f"{on}, these data cannot decide what the simulation by {run} misses: {first}."
    if word == "unknown" and (structure := verdict.get("structure")):
        on_what = " and ".join(c.replace("_", " ") for c in structure["acts_on"])
        acts = f" on {on_what}" if structure["acts_on"] else ""
        return f"{on}, something acts{acts} that no known cause explains."
    if word == "coverage":
        return f"{on}, {run} is outside its training data, so nothing can be said of the ship."
    if word == "external":
        return f"{on}, the ship was pushed, held or towed: that is no error of {run}."
    return f"{on}: no verdict on the simulation by {run}."


def names_of(source: Source) -> str:
    """The voyages and their days: the scope of the claim."""
    voyages = source.subject["voyages"]
    names = listed((one["name"] for one in voyages), most=MOST_VOYAGES)
    return f"{names} ({dates([one['start'] for one in voyages])})"


def _begun(text: str) -> str:
    """With a capital letter, the others as they are."""
    return text[:1].upper() + text[1:]


def _of(cause: Mapping[str, Any]) -> str | None:
    for key in ("channel", "actuator"):
        if key in cause["parameters"]:
            return str(cause["parameters"][key]["value"])
    return None


def blocks(source: Source) -> list[Block]:
    verdict = source.verdict
    pairs: list[tuple[str, Sequence[Line]]] = [
        ("What is wrong?", _what(verdict)),
        ("How sure?", _sure(verdict)),
        ("How big?", _big(verdict)),
        ("What do I do?", _do(verdict)),
        ("What would have been missed?", missed(verdict)),
    ]
    return [Answers(pairs)]


def _what(verdict: Mapping[str, Any]) -> list[Line]:
    if verdict["causes"]:
        found: list[Line] = [[cause["sentence"]] for cause in verdict["causes"]]
        if (rest := _outside(verdict)) is not None:
            found.append(
                [f"Beside that, something acts that no cause of the catalogue explains{rest}."]
            )
        return found
    return [[verdict["sentence"]]]


def _outside(verdict: Mapping[str, Any]) -> str | None:
    """The family, in brackets, of what acts outside the catalogue; None where that is not sure."""
    for one in verdict["ranking"]:
        if one["name"].startswith("unknown") and one["probability"] >= STATED:
            family = one["name"].partition(":")[2].replace("_", " ")
            return f" ({family})" if family else ""
    return None


def _sure(verdict: Mapping[str, Any]) -> list[Line]:
    ranking = verdict["ranking"]
    if not ranking:
        return [["No answer was weighed against another."]]
    stated = [one for one in ranking if one["probability"] >= STATED] or ranking[:3]
    found: list[Line] = [
        [f"{_begun(spoken(one['name']))}: probability ", probability(one["probability"]), "."]
        for one in stated
    ]
    if ranking[0]["probability"] >= STATED:
        return [*found, [CALIBRATED]]
    if verdict["verdict"] == "none":
        return [found[0], [NOT_FAVOURED]]
    return [*found, [NONE_STATED]]


def _big(verdict: Mapping[str, Any]) -> list[Line]:
    found: list[Line] = []
    for cause in verdict["causes"]:
        for name, one in cause["parameters"].items():
            if isinstance(one["value"], str):
                continue
            unit = one["unit"]
            title = f"{_begun(spoken(cause['name']))}, {name.replace('_', ' ')}: "
            found.append([
                title, number(one["value"], unit), " (", number(one["low"], unit), " to ",
                number(one["high"], unit), ").",
            ])  # fmt: skip
    if gain := verdict.get("gain"):
        found.append([
            "It explains ", share(gain["reduction"]), " of the error on held-out windows (",
            share(gain["low"]), " to ", share(gain["high"]), ").",
        ])  # fmt: skip
    elif verdict["wrong"]:
        worst = max(verdict["wrong"], key=lambda one: one["share_of_error"])
        found.append([
            share(worst["share_of_error"]), " of the error is in ",
            worst["channel"].replace("_", " "), ".",
        ])  # fmt: skip
    return found or [["Nothing could be measured."]]


def _do(verdict: Mapping[str, Any]) -> list[Line]:
    own = [cause["remedy"] for cause in verdict["causes"] if cause.get("remedy")]
    if own:
        found: list[Line] = [[text] for text in dict.fromkeys(own)]
        if _outside(verdict) is not None:
            found.append(["Expect the rest of the error to stay until its cause is known."])
        return found
    if verdict["contradictions"]:
        return [["Correct the profile where the channels contradict each other, and ingest again."]]
    if verdict["verdict"] == "undecided" and not any(
        note.startswith(SEPARATES) for note in verdict["notes"]
    ):
        return [[NO_TEST]]
    return [[TO_DO.get(verdict["verdict"], "Look at the causes below, and test them.")]]


def missed(verdict: Mapping[str, Any]) -> list[Line]:
    """Causes that no realistic size would have shown, were not testable, or were not assessed; and
    the smallest size that the named ones would have had to have."""
    found: list[Line] = []
    hidden = [one for one in verdict["limits"] if one["share"] > 1.0]
    if hidden:
        text = "; ".join(
            f"{spoken(one['name'], one.get('channel') or one.get('actuator'))} below "
            f"{size_in_words(one['parameters']) or 'any size'}"
            for one in hidden[:MOST_MISSED]
        )
        more = len(hidden) - MOST_MISSED
        rest = f"; and {more} more" if more > 0 else ""
        said = f"Even at a realistic size: {text}{rest}."
        found.append([said.replace(" %", "\u202f%")])  # never apart at the end of a line
    elif verdict["limits"]:
        found.append([f"At a realistic size, none of {len(verdict['limits'])} causes."])
    became = [(name, state) for name, state, _ in considered.table(verdict)]
    if absent := sum(state == considered.ABSENT for _, state in became):
        found.append([f"Not assessed: {absent} of {len(became)} causes."])
    if untested := [name for name, state in became if state == considered.UNTESTABLE]:
        text = ", ".join(untested[:MOST_MISSED])
        more = len(untested) - MOST_MISSED
        found.append([f"Not testable here: {text}{f', and {more} more' if more > 0 else ''}."])
    return found or [["Nothing was tested, so anything may be missed."]]
