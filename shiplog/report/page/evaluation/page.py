"""The page of an evaluation."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from shiplog.exceptions import listed
from shiplog.logs.health.health_report import DerivedChannel
from shiplog.nomenclature.channels import DEGREE
from shiplog.nomenclature.numbers import counted, figure, percent
from shiplog.report.diagnosis.sections.subject import MOST_VOYAGES, begin, dates
from shiplog.report.diagnosis.terms import TERMS
from shiplog.report.evaluation import derived
from shiplog.report.page.blocks import (
    Answers,
    Block,
    Fold,
    Gallery,
    Grid,
    Items,
    Line,
    Number,
    Page,
    Paragraph,
    Section,
    moment,
    number,
    or_diverged,
    seconds,
    share,
)
from shiplog.report.page.drawing import gallery
from shiplog.report.page.evaluation import trust
from shiplog.report.page.evaluation.source import Source

COVERAGE = ("wind", "drift")
BASELINES = {"hold": "holding the velocity", "least_squares": "quadratic least squares"}
OWN_TERMS = ("L", "90 % interval")
MOST_TRACKS = 12  # voyages with a chart of their own


def of_source(source: Source) -> Page:
    subject = source.subject
    names = listed((one["name"] for one in subject["voyages"]), most=MOST_VOYAGES)
    when = dates([one["start"] for one in subject["voyages"]])
    runs = list(source.answers)
    judged = source.answers[runs[0]]
    better = _beats(judged)
    word = "better than its baselines" if better else "not better than every baseline"
    if len(runs) > 1:
        word = "compared"
    return Page(
        title=f"{subject['ship']}: evaluation of {listed(runs, most=3)}",
        kicker=f"{subject['ship']}, {subject['length_m']:g} m · {names} · {when} · "
        f"{listed(runs, most=4)} · shiplog {subject['shiplog']}",
        word=word,
        tone="good" if better and len(runs) == 1 else "open",
        claim=_claim(runs[0], judged, source),
        sections=[
            Section("answer", "The answer", _answer(source)),
            Section("where", "Where it shows", _where(source)),
            Section("voyages", "Voyages and windows", _voyages(source)),
            *_trust(source),
            Section("coverage", "Training and test", [Gallery(gallery(source.content, COVERAGE))]),
            Section("execution", "Execution", _execution(source)),
            Section("terms", "Terms", [Fold("Terms of the method", [_terms()])]),
        ],
    )


def _claim(run: str, answer: Mapping[str, Any], source: Source) -> str:
    """How far off, where: the answer with its scope, in one sentence."""
    subject, judged = source.subject, answer["judgement"]
    names = listed((one["name"] for one in subject["voyages"]), most=MOST_VOYAGES)
    when = dates([one["start"] for one in subject["voyages"]])
    held = counted(answer["windows"], "window")
    also = ""
    if lost := judged["diverged"]:
        held, also = f"{answer['windows'] - lost} of {held}", f"; {lost} diverged"
    if len(source.answers) > 1:
        each = "; ".join(_off(name, one) for name, one in source.answers.items())
        return f"After {subject['window_s']} s, medians of {held} of {names} ({when}): {each}."
    lengths, degrees = judged["median_end_position_lengths"], judged["median_end_heading_deg"]
    if lengths is None or not math.isfinite(lengths):
        return f"On {held} of {names} ({when}), {run} diverges."
    return (
        f"After {subject['window_s']} s {run} is {figure(lengths)} ship lengths and "
        f"{figure(degrees)} deg off, in the median of "
        f"{held} of {names} ({when}){also}."
    )


def _off(run: str, answer: Mapping[str, Any]) -> str:
    """How far off one of several runs is."""
    judged = answer["judgement"]
    lengths, lost = judged["median_end_position_lengths"], judged["diverged"]
    if lengths is None or not math.isfinite(lengths):
        return f"{run} diverges"
    degrees = figure(judged["median_end_heading_deg"])
    also = f", {lost} diverged" if lost else ""
    return f"{run} {figure(lengths)} ship lengths and {degrees} deg off{also}"


def _beats(answer: Mapping[str, Any]) -> bool:
    """Whether L is below that of every baseline."""
    loss, floors = answer["loss"], answer["floors"]
    return loss is not None and all(v is None or loss < v for v in floors.values())


def _answer(source: Source) -> list[Block]:
    run, answer = next(iter(source.answers.items()))
    length, window = source.subject["length_m"], source.subject["window_s"]
    yaw_rate = answer["rmse"]["yaw_rate"]
    big: list[Line] = [
        [f"After {window} s {run} is ", number(answer["end_position_m"], "m"), " (",
         figure(answer["end_position_m"] / length), " ship lengths) and ",
         number(answer["end_heading_deg"], "deg"), " off, in the mean."],
        ["Root mean square: surge ", number(answer["rmse"]["surge"], "m/s"), ", sway ",
         number(answer["rmse"]["sway"], "m/s"), ", yaw rate ",
         Number(yaw_rate, f"{yaw_rate / DEGREE:.2g}\u202fdeg/s"),
         "."],
    ] if answer["end_position_m"] is not None else [[_diverged(answer)]]  # fmt: skip
    sure: list[Line] = [[number(answer["windows"]), f" windows of {window} s."]]
    if answer["band_90"]:
        inside = answer["band_90"].values()
        sure.append([f"The 90 % band that {run} states holds ", _span(list(inside)),
                     " of the samples of a channel."])  # fmt: skip
    else:
        sure.append([f"{run} states no band of its own."])
    if len(answer.get("seeds", ())) > 1:
        sure.append([f"Numbers are means of {len(answer['seeds'])} seeds; the pictures show the "
                     "seed whose error is the median."])  # fmt: skip
    seen = [one["coverage"] for one in answer["voyages"].values() if one["coverage"] is not None]
    where: list[Line] = [
        ["Inside the training data: ", _span(seen), " of the seconds of a voyage."]
        if seen else ["Coverage is not known."],
        [_worst_in_words(answer)],
    ]  # fmt: skip
    return [
        Answers([
            ("How good?", [[one["sentence"]] for one in source.answers.values()]),
            ("How big are the errors?", big),
            ("How sure?", sure), ("Where is it worst?", where),
        ]),
        _models(source),
    ]  # fmt: skip


def _diverged(answer: Mapping[str, Any]) -> str:
    lost = answer["judgement"]["diverged"]
    if lost >= answer["windows"]:
        return "Every window diverged."
    return f"{lost} of {counted(answer['windows'], 'window')} diverged, so there is no mean."


def _span(shares: Sequence[float]) -> str:
    """The least and the largest share; one number where they are written alike."""
    low, high = percent(min(shares)), percent(max(shares))
    return low if low == high else f"{low} to {high}"


def _worst_in_words(answer: Mapping[str, Any]) -> str:
    worst = answer.get("worst") or []
    if not worst:
        return "No window was simulated."
    one = worst[0]
    why = f" {one['reason'][:1].upper()}{one['reason'][1:]}." if one["reason"] else ""
    return f"{one['voyage']}, from {one['start_s']:.0f} s on.{why}"


def _models(source: Source) -> Grid:
    rows = []
    for name, answer in source.answers.items():
        rows.append((
            [name], or_diverged(answer["loss"]), or_diverged(answer["end_position_m"], "m"),
            or_diverged(answer["end_heading_deg"], "deg"),
        ))  # fmt: skip
    floors = next(iter(source.answers.values()))["floors"]
    rows += [([f"baseline: {BASELINES.get(k, k)}"], or_diverged(v), ["-"], ["-"])
             for k, v in floors.items()]  # fmt: skip
    head = ("model", "L", "position at the end", "heading at the end")
    return Grid(head, rows, head[1:], "Models and baselines on the same windows")


def _where(source: Source) -> list[Block]:
    names = ("closeup", "position_error", "heading_error", "windows")
    found: list[Block] = [Gallery(gallery(source.content, names))]
    tracks = [d for v in source.content.data.names[:MOST_TRACKS]
              for d in gallery(source.content, ("track",), v)]  # fmt: skip
    if tracks:
        found.append(Fold("Tracks of every voyage", [Gallery(tracks)]))
    return found


def _voyages(source: Source) -> list[Block]:
    answer = next(iter(source.answers.values()))
    rows = [
        ([name], or_diverged(one["loss"]), [number(one["windows"])],
         [share(one["coverage"])] if one["coverage"] is not None else ["-"])
        for name, one in answer["voyages"].items()
    ]  # fmt: skip
    head = ("voyage", "L", "windows", "inside the training data")
    found: list[Block] = [Grid(head, rows, head[1:])]
    if worst := answer.get("worst"):
        lines = [
            ([one["voyage"]], [seconds(one["start_s"])], or_diverged(one["loss"]),
             [one["reason"] or "inside the training data"])
            for one in worst
        ]  # fmt: skip
        titles = ("voyage", "from", "L", "why")
        found.append(Grid(titles, lines, titles[1:3], "Worst windows"))
        found.append(Paragraph(["The worst of them in the recording:"]))
        runs = [run["path"] for run in source.subject["runs"]]
        store, first = source.subject["store"], worst[0]
        found.append(moment(runs, store, first["voyage"], first["start_s"]))
    return found


def _trust(source: Source) -> list[Section]:
    blocks = trust.blocks(source)
    return [Section("trust", "What may be trusted", blocks)] if blocks else []


def _execution(source: Source) -> list[Block]:
    subject = source.subject
    rows = [
        ([one["name"]], [begin(one["start"])], [seconds(one["seconds"])])
        for one in subject["voyages"]
    ]
    head = ("voyage", "start, UTC", "length")
    lines: list[Line] = [
        [f"{run['name']}: {run['model']}, trained on {listed(run['trained_on'], most=6)}."]
        for run in subject["runs"]
    ]
    answer = next(iter(source.answers.values()))
    if answer["too_short"]:
        lines.append([f"Without a window of that length: {listed(answer['too_short'])}."])
    made = [DerivedChannel(**one) for one in answer.get("derived", ())]
    if said := derived.loss_sentence(made, subject["window_s"] - 1.0):
        lines.append([said])
    return [Grid(head, rows, head[2:]), Items(lines)]


def _terms() -> Grid:
    rows: list[tuple[Line, Line]] = [([t], [text]) for t, text in TERMS if t in OWN_TERMS]
    return Grid(("term", "what it is"), rows)
