"""limits.toml from today's results: a golden run, with a margin for what changes by chance."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Sequence
from pathlib import Path

from shiplog.exceptions import listed
from shiplog.machine import files
from shiplog.machine.paths import refuse_taken
from shiplog.models.causes import Cause
from shiplog.nomenclature.channels import STATE
from shiplog.nomenclature.numbers import counted, figure
from shiplog.report.evaluation.evaluation import Evaluation
from shiplog.report.evaluation.text_table import one_line
from shiplog.report.gate import cause_names
from shiplog.report.gate.diagnosed import Detectable, Diagnosed, Named
from shiplog.report.gate.limits_file import VERDICTS, given, parse
from shiplog.report.gate.outcome import Measured
from shiplog.report.gate.verdict_limits import detectable_size, size_of
from shiplog.report.gate.window_limits import KINDS, Kind, Scored, inside_band

# The difference of two means of equally many windows has √2 times the standard deviation of one. A
# limit so many half-widths of the 90 % interval away is exceeded once in twenty times by a model
# and a ship that have not changed.
MARGIN = math.sqrt(2.0)
WITHOUT_INTERVAL = 0.5  # share of an error, where there are too few windows for an interval
BAND_MARGIN = 0.1  # of the share inside the 90 % band: as far from it as all samples are above
COVERED_MARGIN = 0.1  # of the share that is covered, where it has no interval
TIE = 1e-9  # of a count of steps: what is whole but for rounding stays
BARE = re.compile(r"[A-Za-z0-9_-]+")
LEAST_SHARE = 0.05  # a lower limit below it would limit nothing
REALISTIC = 1.0  # share of its realistic size, up to which a smallest detectable one is listed


def write(path: Path, content: str) -> int:
    """Write a new limits.toml. Returns how many limits it has. Raises RunError where something is
    there already."""
    limits = parse(content, str(path))
    refuse_taken(path, "--limits")
    files.write_text(path, content)
    sections = (limits.simulation, limits.band, limits.diagnosis)
    return sum(len(given(one)) for one in sections) + sum(map(len, limits.sizes.values()))


def text(
    found: Evaluation,
    verdict: Diagnosed | None,
    own: Sequence[Cause] = (),
    windless: bool = False,
) -> str:
    """The file, of an evaluation of one run. Each limit has today's figure behind it as a comment.

    own       causes of the user's own
    windless  whether the model has no wind force
    """
    run, of = found.runs[0], Scored.of(found)
    assert of is not None  # an evaluation without a window is refused
    lines = [
        f"# Limits, written by `shiplog gate --write` from {run.name} on",
        f"# {listed(found.voyages)}.",
        "# Margin: √2 times the half-width of the 90 % interval. A model and a ship that have not",
        "# changed exceed such a limit once in twenty times. Edit what is to be stricter.",
        f"window_s = {of.seconds}",
        "",
        f"[simulation]  # {counted(len(of.voyages), 'window')}",
        *[line for kind in KINDS for line in _window_line(kind, of)],
    ]
    if not found.inside.is_empty():
        shares = [(c.name, inside_band(found, c.name)) for c in STATE]
        lines += ["", "[band]  # share inside the 90 % band, at least"]
        lines += [line for name, share in shares for line in _share_line(name, share, BAND_MARGIN)]
    if verdict is not None:
        allowed = [word for word in VERDICTS if word in ("none", verdict.verdict)]
        lines += ["", "[diagnosis]", f"allowed = {json.dumps(allowed)}  # today: {verdict.verdict}"]
        if verdict.causes:
            named = json.dumps([_label(one) for one in verdict.causes], ensure_ascii=False)
            lines.append(f"causes_allowed = {named}")
        if sizes := _sizes(verdict, own, windless):
            lines += ["", "[sizes]", *sizes]
    return "\n".join(map(one_line, lines)) + "\n"


def _window_line(kind: Kind, of: Scored) -> list[str]:
    measured = kind.measure(of)
    if kind.at_least:
        return _share_line(kind.key, measured, COVERED_MARGIN)
    value = measured.value
    if value is None or not math.isfinite(value) or value <= 0.0:
        return [f"# {kind.key}: {measured.reason or 'nothing measured'}"]
    if measured.high is None:
        high = value * (1.0 + WITHOUT_INTERVAL) ** (2 if kind.key.startswith("loss") else 1)
    else:
        high = value + MARGIN * (measured.high - value)
    today = f"{_in_words(measured)} {kind.unit}".rstrip()
    return [f"{kind.key} = {_rounded(high, up=True)}  # today: {today}"]


def _share_line(key: str, measured: Measured, margin: float) -> list[str]:
    """A lower limit on a share; a comment where none above 0 is left."""
    value = measured.value
    if value is None:
        return [f"# {key}: {measured.reason}"]
    low = value - margin if measured.low is None else value - MARGIN * (value - measured.low)
    if low < LEAST_SHARE:
        return [f"# {key}: today {_in_words(measured)}, too little for a limit"]
    return [f"{key} = {_rounded(low, up=False)}  # today: {_in_words(measured)}"]


def _sizes(verdict: Diagnosed, own: Sequence[Cause], windless: bool) -> list[str]:
    """A limit on each cause that is there. What else would have shown is a comment: the smallest
    detectable size depends on what was sailed, and is no promise of the ship's."""
    lines, there = [], (*verdict.causes, *verdict.traces)
    for one in there:
        for parameter in cause_names.sized(one.name, list(one.parameters), own):
            at = cause_names.neutral(one.name, parameter, own, windless)
            size = size_of(one, parameter, at)
            if size.value is not None and size.high is not None:
                far = size.value + MARGIN * (size.high - size.value)
                unit = cause_names.unit_of(one.name, parameter, own)
                why = f"today: {_in_words(size)} {unit}".rstrip()
                lines.append(f"{_key(_label(one))}.{parameter} = {_rounded(far, up=True)}  # {why}")
    for one in verdict.limits:
        if any((one.name, one.part) == (known.name, known.part) for known in there):
            continue
        if one.share is None or one.share > REALISTIC or verdict.not_excluded(_label(one)):
            continue
        for parameter in cause_names.sized(one.name, list(one.parameters), own):
            if least := detectable_size(one, parameter):
                unit = cause_names.unit_of(one.name, parameter, own)
                least_size = f"{figure(least, 3)} {unit}".rstrip()
                lines.append(
                    f"# {_key(_label(one))}.{parameter}: not found, detectable from {least_size}"
                )
    return lines


def _label(of: Named | Detectable) -> str:
    return f"{of.name}:{of.part}" if of.part else of.name


def _key(text: str) -> str:
    """As TOML has keys: bare, or in quotes."""
    return text if BARE.fullmatch(text) else json.dumps(text, ensure_ascii=False)


def _rounded(value: float, up: bool) -> str:
    """To two significant digits, away from today's figure."""
    step = 10.0 ** (math.floor(math.log10(value)) - 1)
    count = value / step
    whole = math.ceil(count - TIE) if up else math.floor(count + TIE)
    return f"{whole * step:.12g}"


def _in_words(measured: Measured) -> str:
    value = figure(measured.value or 0.0, 3)
    if measured.low is None or measured.high is None:
        return value
    return f"{value} ({figure(measured.low, 3)} to {figure(measured.high, 3)})"
