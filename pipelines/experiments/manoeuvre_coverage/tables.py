"""Shares and widths over all ships: of quantities, of kinds of ships, of coefficients."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import polars as pl
from scipy.stats import binomtest

from shiplog.report.evaluation.text_table import table

COLUMNS = ("measured", "simulated", "extended")
RELATIVE = ("advance", "transfer", "tactical_diameter", "steady_diameter", "initial_turning",
            "check_time", "period")  # fmt: skip
UNITS = {"speed_loss": "", "drift_angle": " deg"}
NAMED = (*RELATIVE, "drift_angle", "speed_loss", "first_overshoot", "second_overshoot",
         "third_overshoot")  # fmt: skip


def quantities(ships: Sequence[dict[str, Any]]) -> pl.DataFrame:
    """A row a quantity of a trial and an interval of it.

    what     measured, simulated, extended
    against  true: the path as it was; calm: the same without gusts and process noise
    inside   whether the interval has it; width and error in the unit of `unit_of`
    """
    rows = []
    for ship in ships:
        for row in ship["quantities"]:
            for what in COLUMNS:
                found = row.get(what)
                for against in ("true", "calm"):
                    true = row.get(against)
                    if found is None or true is None or (what, against) == ("measured", "calm"):
                        continue
                    value, low, high, note = found
                    unit = abs(true) if row["quantity"] in RELATIVE else 1.0
                    rows.append({
                        "ship": ship["ship"], "family": ship["family"],
                        "changed": ship["changed"], "trial": row["trial"],
                        "quantity": row["quantity"], "what": what, "against": against,
                        "true": true, "value": value, "low": low, "high": high, "note": note,
                        "inside": low <= true <= high, "width": (high - low) / unit,
                        "error": (value - true) / unit,
                    })  # fmt: skip
    return pl.DataFrame(rows, infer_schema_length=None)


def missing(ships: Sequence[dict[str, Any]]) -> dict[str, int]:
    """How many quantities that the ships had are without an interval of each kind."""
    rows = [row for ship in ships for row in ship["quantities"]]
    return {what: sum(row.get(what) is None for row in rows) for what in COLUMNS[:2]}


def worst_first(frame: pl.DataFrame) -> pl.DataFrame:
    """Rows of the quantity that is least often inside first."""
    return frame.with_columns(pl.col("inside").mean().over("quantity").alias("often")).sort(
        "often", "quantity", maintain_order=True
    )


def extended_pairs(frame: pl.DataFrame) -> str | None:
    """Simulated and extended where there are both; None where there is no such ship."""
    keys = ["ship", "trial", "quantity"]
    both = frame.filter(pl.col("what") == "extended").select(keys)
    if both.is_empty():
        return None
    paired = frame.filter(pl.col("what") != "measured").join(both, on=keys, how="semi")
    return by(paired, "changed", "what") + "\n\n" + by(paired, "what")


def share(inside: int, count: int) -> str:
    """`91 % (88 to 94)`: with the 95 % interval of a share (Clopper & Pearson 1934)."""
    if not count:
        return "-"
    low, high = binomtest(inside, count).proportion_ci(0.95)
    return f"{inside / count:.0%} ({100 * low:.0f} to {100 * high:.0f})"


def by(frame: pl.DataFrame, *keys: str) -> str:
    """Shares, median widths and errors of each group."""
    found = frame.group_by(*keys, maintain_order=True).agg(
        pl.len().alias("count"), pl.col("inside").sum(), pl.col("width").median(),
        pl.col("error").abs().median().alias("off"), pl.col("error").median().alias("bias"),
    )  # fmt: skip
    rows = [
        (*(str(r[key]).replace("_", " ") for key in keys), r["count"],
         share(r["inside"], r["count"]), _sized(r, "width"), _sized(r, "off"), _sized(r, "bias"))
        for r in found.iter_rows(named=True)
    ]  # fmt: skip
    head = (*keys, "number", "inside", "median width", "median error", "median bias")
    return table(head, rows, head[len(keys) :])


def _sized(row: dict[str, Any], key: str) -> str:
    value = row[key]
    if "quantity" not in row or row["quantity"] in RELATIVE:
        return f"{value:.1%}"
    return f"{value:.2f}{UNITS.get(row['quantity'], ' deg')}"


def coefficients(ships: Sequence[dict[str, Any]]) -> pl.DataFrame:
    """A row a coefficient of a ship that its truth has too."""
    rows = [
        {"ship": ship["ship"], "family": ship["family"], **one}
        for ship in ships for one in ship["coefficients"]
    ]  # fmt: skip
    return pl.DataFrame(rows, infer_schema_length=None).with_columns(
        inside=pl.col("true").is_between("low", "high"),
        off=(pl.col("value") - pl.col("true")) / ((pl.col("high") - pl.col("low")) / 3.29),
        plausible=pl.col("true").is_between(
            pl.col("typical").list.get(0), pl.col("typical").list.get(1)
        ),
    )  # fmt: skip


def trust(frame: pl.DataFrame, *keys: str) -> str:
    found = frame.group_by(*keys, maintain_order=True).agg(
        pl.len().alias("count"), pl.col("inside").sum(), pl.col("plausible").mean(),
        pl.col("off").abs().median(), pl.col("off").pow(2).mean().sqrt().alias("rms"),
    )  # fmt: skip
    rows = [
        (*(str(r[key]) for key in keys), r["count"], share(r["inside"] or 0, r["count"]),
         f"{r['plausible']:.0%}", f"{r['off']:.1f}", f"{r['rms']:.1f}")
        for r in found.sort(*keys).iter_rows(named=True)
    ]  # fmt: skip
    head = (*keys, "number", "true value inside", "inside the typical range",
            "median error in standard errors", "root mean square of it")  # fmt: skip
    return table(head, rows, head[len(keys) :])
