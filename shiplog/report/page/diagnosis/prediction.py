"""How good the simulation is, apart from what ran: L before and after, channel by channel."""

from __future__ import annotations

from shiplog.report.page.blocks import Block, Gallery, Grid, Line, Paragraph, number, share
from shiplog.report.page.diagnosis.source import Source


def blocks(source: Source) -> list[Block]:
    verdict = source.verdict
    found: list[Block] = []
    if gain := verdict.get("gain"):
        held = gain["held_out_windows"]
        found.append(Paragraph([
            "L (Eq. 8 of Wakita et al. 2024) is ", number(gain["before"]), " before and ",
            number(gain["after"]), " after, on ", number(held),
            f"{' window' if held == 1 else ' windows'}. Each was predicted with numbers that "
            "were fitted without its voyage.",
        ]))  # fmt: skip
    rows = []
    channels = (verdict.get("gain") or {}).get("channels", {})
    for one in verdict["wrong"]:
        after: Line = [share(channels[one["channel"]])] if one["channel"] in channels else ["-"]
        rows.append((
            [one["channel"].replace("_", " ")], [share(one["share_of_error"])], after,
            [one["where"]],
        ))  # fmt: skip
    if rows:
        head = ("channel", "share of the error before", "taken away", "where it is largest")
        found.append(Grid(head, rows, head[1:3]))
    if drawn := source.gallery(("windows",)):
        found.append(Gallery(drawn))
    if not found:
        return [Paragraph(["No prediction was assessed: there is no window to simulate."])]
    return found + _limits(source)


def _limits(source: Source) -> list[Block]:
    """Each declared limit with what became of it."""
    if source.gate is None:
        return [Paragraph([
            "No limit was declared. `shiplog gate RUN --limits FILE --diagnosis FOLDER` holds "
            "these figures against limits of yours, in metres, degrees and sizes of causes.",
        ])]  # fmt: skip
    rows = [
        ([one["name"]], [one["expected"]], [one["found"] or one["reason"]], [one["outcome"]])
        for one in source.gate["limits"]
    ]
    said = Paragraph([f"Against {source.gate['limits_file']}: {source.gate['sentence']}"])
    return [said, Grid(("limit", "asked", "measured", "outcome"), rows)]
