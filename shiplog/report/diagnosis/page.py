"""A verdict on one page, for people."""

from __future__ import annotations

from shiplog.exceptions import listed
from shiplog.nomenclature.numbers import counted, figure, percent
from shiplog.report.diagnosis.verdict import HOPELESS, WHICH, Verdict
from shiplog.report.diagnosis.verdict_sentence import less


def markdown(verdict: Verdict) -> str:
    """Markdown: the causes with numbers and gain, what was rejected or could not be tested and why,
    where errors are."""
    lines = ["# Diagnosis", "", f"**{verdict.sentence}**", ""]
    lines += [f"Model: {verdict.run}, {verdict.made}.", ""]
    for cause in verdict.causes:
        lines += _cause(cause)
    lines += _gain(verdict)
    if verdict.ranking:
        lines += ["## Ranking", "", "| answer | probability |", "| --- | ---: |"]
        lines += [f"| {r['name']} | {r['probability']:.3f} |" for r in verdict.ranking]
        lines.append("")
    for title, rows in (
        ("Rejected", verdict.rejected),
        ("Not testable", verdict.unavailable),
        ("Traces", verdict.traces),
    ):
        if rows:
            lines += [f"## {title}", ""]
            lines += [f"- {r['name']}: {r.get('reason') or r.get('sentence')}" for r in rows]
            lines.append("")
    lines += [*_limits(verdict), *_errors(verdict)]
    if verdict.notes:
        lines += ["## Notes", "", *[f"- {note}" for note in verdict.notes], ""]
    return "\n".join(lines)


def _cause(cause: dict) -> list[str]:
    lines = [
        f"## {cause['name']} (probability {cause['probability']:.2f})", "",
        cause["sentence"], "", f"    {cause['equation']}", "",
        "| parameter | value | 90 % interval | unit |", "| --- | ---: | --- | --- |",
    ]  # fmt: skip
    for name, p in cause["parameters"].items():
        if isinstance(p["value"], str):
            lines.append(f"| {name} | {p['value']} | - | - |")
        else:
            lines.append(
                f"| {name} | {figure(p['value'], 4)} | {figure(p['low'], 4)} to "
                f"{figure(p['high'], 4)} | {p['unit']} |"
            )
    if cause["indistinguishable_from"]:
        lines += [
            "", f"These data cannot tell it from {listed(cause['indistinguishable_from'])}. "
            f"A test that can: {cause['next_test']}.",
        ]  # fmt: skip
    if (expected := cause.get("next_test_expected")) is not None:
        lines += [
            f"Of the simulated manoeuvres, {expected['manoeuvre']} separates them best: "
            f"{figure(expected['nats'], 3)} nats in {expected['seconds']:.0f} s.",
        ]  # fmt: skip
    return [*lines, ""]


def _gain(verdict: Verdict) -> list[str]:
    if verdict.gain is None:
        return []
    g = verdict.gain
    channels = (f"{c.replace('_', ' ')} {round(100.0 * v):d}%" for c, v in g.channels.items())
    return [
        "## Gain on held-out windows", "",
        f"L {g.before:.0f} before, {g.after:.0f} after: {less(g.reduction)} "
        f"({less(g.low)} to {less(g.high)}, {counted(g.windows, 'window')}, each predicted with "
        f"numbers fitted without {verdict.without}).", "",
        "By channel: " + ", ".join(channels) + ".", "",
    ]  # fmt: skip


def _limits(verdict: Verdict) -> list[str]:
    if not verdict.limits:
        return []
    lines = [
        "## Smallest detectable sizes", "",
        "A cause below this size may be present and not found: the change of each number alone, "
        "and all numbers together as a share of the realistic size.", "",
        "| cause | detectable from | of realistic size |", "| --- | --- | ---: |",
    ]  # fmt: skip
    for one in verdict.limits:
        numbers = ", ".join(
            f"{k.replace('_', ' ')} {_change(**v)}" for k, v in one["parameters"].items()
        )
        which = next((one[key] for key in WHICH if key in one), "")
        label = f"{one['name']} ({which})" if which else one["name"]
        share = percent(one["share"]) if one["share"] < HOPELESS else "not detectable"
        lines.append(f"| {label} | {numbers} | {share} |")
    return [*lines, ""]


def _change(value: float, unit: str) -> str:
    """A size in its unit; in per cent where it has none."""
    return f"{figure(100 * value)}%" if unit == "1" else f"{figure(value)} {unit}"


def _errors(verdict: Verdict) -> list[str]:
    """Where the errors are, what they depend on, and what was left out."""
    lines: list[str] = []
    if verdict.wrong:
        lines += ["## Where the errors are", ""]
        lines += [
            f"- {w['channel'].replace('_', ' ')}: {w['share_of_error']:.0%} of the error; "
            f"{w['where']}"
            for w in verdict.wrong
        ]
        lines.append("")
    if verdict.unseen:
        lines += [
            "Dependence of the residual on inputs that the model does not have (cross-validated "
            "R²):", "",
            *[f"- {u['variable']}: {u['sentence']}" for u in verdict.unseen], "",
        ]  # fmt: skip
    if verdict.intervals:
        lines += ["## Stretches left out, or outside the training data", ""]
        lines += [
            f"- {i.voyage}, {i.start_s:.0f} to {i.end_s:.0f} s ({i.kind}): {i.sentence}"
            for i in verdict.intervals
        ]
        lines.append("")
    return lines
