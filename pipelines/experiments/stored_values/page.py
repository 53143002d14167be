"""The outcomes as tables, shares with their 90 % intervals."""

from __future__ import annotations

from collections.abc import Sequence

from scipy.stats import beta

from pipelines.experiments.stored_values.judge import Outcome
from shiplog.report.evaluation import tables


def share(hits: int, of: int) -> str:
    """A share with its 90 % interval (Clopper and Pearson, 1934)."""
    if of == 0:
        return "-"
    low = float(beta.ppf(0.05, hits, of - hits + 1)) if hits else 0.0
    high = float(beta.ppf(0.95, hits + 1, of - hits)) if hits < of else 1.0
    return f"{hits} of {of}: {100 * hits / of:.1f} % ({100 * low:.1f} to {100 * high:.1f})"


def page(outcomes: Sequence[Outcome]) -> str:
    changed = [o for o in outcomes if o.change and o.seen_by != "undetermined"]
    open_ = [o for o in outcomes if o.seen_by == "undetermined"]
    sound = [o for o in outcomes if not o.change]
    text = [f"{len(outcomes)} voyages, seeds {outcomes[0].seed} to {outcomes[-1].seed}.", ""]
    for what, of, hits in (
        ("wrong and unsaid, of changed ones", changed, [o.wrong_and_unsaid for o in changed]),
        ("wrongly alarmed, of sound ones", sound, [o.wrongly_alarmed for o in sound]),
        ("stored wrong, of sound ones", sound, [not o.right for o in sound]),
        ("named all the same, of undetermined changes", open_, [o.named for o in open_]),
    ):
        text.append(f"- {what}: {share(sum(hits), len(of))}")
    text.append("")
    rows = []
    for name in sorted({(o.family, o.change) for o in (*changed, *open_)}):
        of = [o for o in outcomes if o.change == name[1]]
        rows.append((*name, of[0].seen_by, len(of), sum(o.named for o in of),
                     sum(o.right and not o.named for o in of),
                     sum(o.wrong_and_unsaid for o in of)))  # fmt: skip
    head = ("family", "change", "seen by", "voyages", "named", "stored right", "wrong and unsaid")
    text += [tables.table(head, rows), ""]
    for title, bad in (("Wrong and unsaid", [o for o in changed if o.wrong_and_unsaid]),
                       ("Wrongly alarmed", [o for o in sound if o.wrongly_alarmed]),
                       ("Sound, stored wrong", [o for o in sound if not o.right])):  # fmt: skip
        text += [f"## {title}", ""]
        for o in bad[:200]:
            what = f"{o.change or 'sound'}; {o.ship}; {o.instruments} at {o.hz:g} Hz; {o.recorder}"
            said = "; ".join(f[:160] for f in (o.findings[:3] or o.wrong[:3]))
            text.append(f"- {o.seed}: {what}: {said}")
        text.append("")
    return "\n".join(text)
