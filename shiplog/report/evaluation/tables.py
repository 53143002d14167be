"""Tables and sentences for people, in Markdown; their JSON twins for machines."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import polars as pl

from shiplog.exceptions import listed
from shiplog.logs.health.health_report import (
    Finding,
    Instrument,
    NotCompared,
    VoyageReport,
)
from shiplog.nomenclature.channels import WINDOW
from shiplog.nomenclature.contract import CONTRACT
from shiplog.nomenclature.numbers import counted, percent
from shiplog.report.evaluation import derived
from shiplog.report.evaluation.judgement import FEWEST_WINDOWS
from shiplog.report.evaluation.text_table import table
from shiplog.ship_profile.profile import Profile

MOST_FINDINGS = 16  # lines on one log
MOST_NAMED = 4  # channels in one line
PLURAL = {"has": "have", "is": "are"}
MOST_ALIKE = 3  # findings of a kind and channel that are listed one by one

# A lower rate is reported: a manoeuvring ship turns by degrees between two samples.
SELDOM_HZ = 4.5
# A coarser step is reported: about three times what a good instrument is accurate to.
COARSE = {"position": 0.05, "velocity": 0.03, "heading": 0.3, "yaw_rate": 0.3, "wind": 0.3}


def voyage_lines(report: VoyageReport) -> list[str]:
    """What one log's health is, in a few lines: at most a screen."""
    lost = "unknown" if report.messages_lost is None else str(report.messages_lost)
    head = f"{report.name}: {counted(report.messages_read, 'message')} read, {lost} lost; "
    if report.usable_s is None or report.windows is None:
        return [
            f"{head}{report.seconds:.1f} s",
            *_findings(report.findings),
            *_not_compared(report.not_compared),
        ]
    head += (
        f"{report.seconds:.1f} s, of which {report.usable_s} s can be used; "
        f"{counted(report.windows, 'window')} of {WINDOW} s"
    )
    return [
        head,
        *([f"  {said}."] if (said := derived.of_voyages(report.derived)) else []),
        *_instruments(report.instruments),
        *_findings(report.findings),
        *_not_compared(report.not_compared),
    ]


def _not_compared(left: Sequence[NotCompared]) -> list[str]:
    """One line; reasons and what would show it stand in the JSON and in `voyages --sensors`."""
    if not left:
        return []
    return [f"  could not be compared: {'; '.join(one.what for one in left)}."]


def _instruments(instruments: Sequence[Instrument]) -> list[str]:
    """Which of them measure seldom, and which count in coarse steps."""
    rates: dict[float, list[str]] = {}
    for one in instruments:
        if one.rate_hz < SELDOM_HZ:
            rates.setdefault(float(f"{one.rate_hz:.2g}"), []).append(one.channel)
    lines = [
        f"  rate: {listed(names, most=MOST_NAMED)} at {rate:g} Hz; what stands between two "
        "samples is interpolated."
        for rate, names in sorted(rates.items())
    ]
    coarse = [
        f"{one.channel} {one.resolution:.2g} {one.unit}"
        for one in instruments
        if one.resolution > COARSE.get(one.channel, math.inf)
    ]
    if coarse:
        lines.append(f"  resolution: {', '.join(coarse)}; this counts as accuracy.")
    return lines


def _findings(findings: Sequence[Finding]) -> list[str]:
    """Each by itself where they are few of a kind and channel, else their number and largest."""
    groups: dict[tuple[str, str], list[Finding]] = {}
    for finding in sorted(_together(findings), key=lambda one: one.kind != "contradiction"):
        groups.setdefault((finding.kind, finding.channel), []).append(finding)
    lines = []
    for (kind, channel), group in groups.items():
        if len(group) <= MOST_ALIKE:
            lines += [f"  {kind}: {finding.sentence}" for finding in group]
            continue
        largest = max((f for f in group if f.start_s is not None), key=_size, default=group[0])
        if largest.unit == "s":
            total = sum(f.value or 0.0 for f in group if f.unit == "s")  # others are counts
            lines.append(f"  {kind}: {channel}, {total:.1f} s in all; most: {largest.sentence}")
        else:
            lines.append(f"  {kind}: {channel}, {len(group)} times; most: {largest.sentence}")
    left = len(lines) - MOST_FINDINGS
    if left > 0:
        lines = [*lines[:MOST_FINDINGS], f"  and {counted(left, 'more line')}."]
    if any(len(group) > MOST_ALIKE for group in groups.values()) or left > 0:
        lines.append("  all of them, one by one, with --json.")
    return lines


def _together(findings: Sequence[Finding]) -> list[Finding]:
    """What several channels lack over one stretch as one finding: a row of a table was lost."""
    alike: dict[tuple[str, str], list[Finding]] = {}
    for number, one in enumerate(findings):
        rest = one.sentence.removeprefix(f"{one.channel} ")
        verb = rest.split(" ", 1)[0]
        own = rest == one.sentence or one.kind not in ("gap", "blank") or verb not in PLURAL
        alike.setdefault((one.kind, str(number) if own else rest), []).append(one)
    merged = []
    for (_, rest), group in alike.items():
        if len(group) == 1:
            merged += group
            continue
        verb, more = rest.split(" ", 1)
        names = listed([one.channel for one in group], most=MOST_NAMED)
        sentence = f"{names} {PLURAL[verb]} {more}"
        merged.append(replace(group[0], channel=names, sentence=sentence))
    return merged


def _size(finding: Finding) -> float:
    return abs(finding.value or 0.0)


def voyages_json(reports: Sequence[VoyageReport], refused: Mapping[str, object]) -> dict:
    """The contract's answer of `check` and `ingest`; refused: file → why."""
    return {
        "contract": CONTRACT,
        "voyages": [report.as_json() for report in reports],
        "refused": {path: str(why) for path, why in refused.items()},
    }


def estimated(profile: Profile) -> list[str]:
    """Which particulars the profile leaves out, and what stands in for them."""
    missing = [
        name
        for name in (
            "breadth_m",
            "draught_m",
            "mass_kg",
            "x_g_m",
            "block_coefficient",
            "frontal_area_m2",
            "lateral_area_m2",
        )
        if getattr(profile.ship, name) is None
    ]
    if not missing:
        return []
    breadth = "; the hull is drawn a sixth as broad as long" if "breadth_m" in missing else ""
    return [
        f"{profile.source or profile.ship.name} leaves out {', '.join(missing)}: `train --model "
        f"mmg` estimates them; give those that you know{breadth}."
    ]


def summary(errors: pl.DataFrame) -> dict:
    """The figures of one model: L per seed and their mean, RMSE, end errors.

    errors: one row per window and seed, with seed, voyage, window and `scoring.ERRORS`. RMSE is
    over all windows of a seed, then the mean over seeds; end errors are means over both.
    """
    per_seed = (
        errors.group_by("seed")
        .agg(
            pl.col("loss").mean(),
            *[
                pl.col(f"rmse_{name}").pow(2).mean().sqrt()
                for name in ("surge", "sway", "yaw_rate")
            ],
            pl.col("end_position_m", "end_heading_deg").mean(),
        )
        .sort("seed")
    )
    windows = errors.select("voyage", "window").unique().height
    return {
        "loss": float(per_seed["loss"].mean()),  # type: ignore[arg-type]
        "windows": windows,
        "seeds": per_seed["loss"].to_list(),
        "rmse": {
            name: float(per_seed[f"rmse_{name}"].mean())  # type: ignore[arg-type]
            for name in ("surge", "sway", "yaw_rate")
        },
        "end_position_m": float(per_seed["end_position_m"].mean()),  # type: ignore[arg-type]
        "end_heading_deg": float(per_seed["end_heading_deg"].mean()),  # type: ignore[arg-type]
    }


def evaluation_json(
    errors: pl.DataFrame, baselines: dict[str, float], coverage: pl.DataFrame
) -> dict:
    """The contract's answer of `evaluate`.

    coverage: one row per window, with voyage, window and coverage (0 to 1).
    """
    per_voyage = errors.group_by("voyage").agg(
        pl.col("loss").mean(), windows=pl.col("window").n_unique()
    )
    covered = coverage.group_by("voyage").agg(pl.col("coverage").mean())
    voyages = {
        row["voyage"]: {key: row[key] for key in ("loss", "windows", "coverage")}
        for row in per_voyage.join(covered, on="voyage").sort("voyage").to_dicts()
    }
    return {"contract": CONTRACT, **summary(errors), "floors": baselines, "voyages": voyages}


def models_table(summaries: dict[str, dict], baselines: dict[str, float], fitted_on: str) -> str:
    """One row for each model and each baseline.

    fitted_on: the run whose training data the least-squares baseline was fitted to.
    """
    rows = []
    for label, s in summaries.items():
        spread = f"{min(s['seeds']):.0f} to {max(s['seeds']):.0f}" if len(s["seeds"]) > 1 else "-"
        rows.append(
            (
                label,
                s["loss"],
                spread,
                s["rmse"]["surge"],
                s["rmse"]["sway"],
                math.degrees(s["rmse"]["yaw_rate"]),
                s["end_position_m"],
                s["end_heading_deg"],
            )
        )
    names = {
        "hold": "baseline: hold the velocity",
        "least_squares": f"baseline: quadratic least squares on the data of {fitted_on}",
    }
    dash = "-"
    rows += [(names[k], v, dash, dash, dash, dash, dash, dash) for k, v in baselines.items()]
    head = (
        "model",
        "L",
        "L over seeds",
        "RMSE u [m/s]",
        "RMSE v [m/s]",
        "RMSE r [deg/s]",
        "end position [m]",
        "end heading [deg]",
    )
    return table(head, rows)


def windows_table(errors: pl.DataFrame, coverage: pl.DataFrame, most: int = 8) -> str:
    """The worst windows, with where they left the training data."""
    mean = errors.group_by("voyage", "window").agg(
        pl.col("loss", "end_position_m", "end_heading_deg").mean(), pl.col("elapsed").first()
    )
    rows = (
        mean.join(coverage, on=["voyage", "window"])
        .sort("loss", descending=True)
        .head(most)
        .select(
            "voyage", "elapsed", "loss", "end_position_m", "end_heading_deg", "coverage", "reason"
        )
        .rows()
    )
    cells = [
        (v, f"{t:.0f}", loss, p, h, percent(c), why or "-") for v, t, loss, p, h, c, why in rows
    ]
    return table(
        (
            "voyage",
            "from [s]",
            "L",
            "end position [m]",
            "end heading [deg]",
            "covered",
            "outside the training data",
        ),
        cells,
    )


def parameters_table(identified: pl.DataFrame) -> str:
    """Every parameter that was free: start, value, standard error, and how far it moved."""
    rows = [
        (
            r["name"],
            r["symbol"],
            r["meaning"],
            f"{r['start']:.4g}",
            f"{r['value']:.4g}",
            f"{r['standard_error']:.2g}",
            f"{(r['value'] - r['start']) / r['spread']:+.1f}",
        )
        for r in identified.filter(pl.col("free")).to_dicts()
    ]
    head = ("parameter", "symbol", "what", "start", "value", "standard error", "moved (spreads)")
    return table(head, rows)


WIND_BIN = 1.0  # m/s


def winds(errors: pl.DataFrame) -> pl.DataFrame:
    """run, low, high [m/s], windows, loss: L by the mean apparent wind of a window."""
    low = (pl.col("wind_speed") / WIND_BIN).floor() * WIND_BIN
    return (
        errors.drop_nulls("wind_speed")
        .with_columns(low=low, high=low + WIND_BIN)
        .group_by("run", "low", "high", maintain_order=True)
        .agg(windows=pl.struct("voyage", "window").n_unique(), loss=pl.col("loss").mean())
        .sort("low", maintain_order=True)
    )


def wind_lines(errors: pl.DataFrame) -> list[str]:
    """A table of L by wind, a column a run, and a blank line; nothing without a wind sensor."""
    found = winds(errors)
    names = errors["run"].unique(maintain_order=True).to_list()
    if found.is_empty():
        return []
    rows = []
    for low in found["low"].unique(maintain_order=True):
        here = {r["run"]: r for r in found.filter(pl.col("low") == low).to_dicts()}
        one = here[names[0]]
        span = f"{one['low']:.0f} to {one['high']:.0f}"
        rows.append((span, one["windows"], *(here[n]["loss"] for n in names)))
    head = ("apparent wind [m/s]", "windows", *(f"L of {n}" for n in names))
    return ["By wind:", "", table(head, rows), ""]


def band_lines(inside: pl.DataFrame) -> list[str]:
    """What share of the samples lies inside each run's 90 % band, and a blank line."""
    lines = []
    for run in inside["run"].unique(maintain_order=True):
        mine = inside.filter(pl.col("run") == run)
        shares = ", ".join(
            f"{channel.replace('_', ' ')} {percent(share)}"
            for channel, share in mine.select("channel", "share").iter_rows()
        )
        lines.append(f"Inside the 90 % band of {run}: {shares}.")
    return [*lines, ""] if lines else []


def voyages_table(answer: dict) -> str:
    """L, windows and coverage of each voyage; for a few windows no share is given."""
    rows = [
        (
            name,
            v["windows"],
            v["loss"],
            percent(v["coverage"]) if v["windows"] >= FEWEST_WINDOWS else "-",
        )
        for name, v in answer["voyages"].items()
    ]
    return table(("voyage", "windows", "L", "covered"), rows)
