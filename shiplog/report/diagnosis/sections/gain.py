"""What the named causes take off the error on held-out windows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from shiplog.nomenclature.numbers import counted
from shiplog.report.diagnosis.verdict_sentence import less
from shiplog.simulation.error_reduction import Gain


@dataclass(frozen=True, slots=True)
class HeldOutGain:
    """Error on held-out windows without and with the named causes; only where one is named.

    before     L, Eq. 8 of Wakita et al. 2024, mean over the windows
    after      the same
    reduction  1 - after / before
    low        of the 90 % interval of `reduction`
    high       of it
    channels   `reduction` by channel
    """

    before: float
    after: float
    reduction: float
    low: float
    high: float
    held_out_windows: int
    channels: Mapping[str, float]


def of(found: Gain) -> HeldOutGain:
    return HeldOutGain(**found.as_json())


def markdown(found: Gain | None, without: str) -> list[str]:
    """`without`: the data that the numbers of each window were fitted without."""
    if found is None:
        return []
    g = found
    channels = (f"{c.replace('_', ' ')} {round(100.0 * v):d}%" for c, v in g.channels.items())
    return [
        "## Gain on held-out windows", "",
        f"L {g.before:.0f} before, {g.after:.0f} after: {less(g.reduction)} "
        f"({less(g.low)} to {less(g.high)}, {counted(g.windows, 'window')}, each predicted with "
        f"numbers fitted without {without}).", "",
        "By channel: " + ", ".join(channels) + ".", "",
    ]  # fmt: skip
