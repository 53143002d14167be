"""The result of `shiplog evaluate`: errors of runs on the same test windows, their sentences,
tables and JSON."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import polars as pl

from shiplog.exceptions import listed
from shiplog.nomenclature.contract import CONTRACT
from shiplog.nomenclature.numbers import counted
from shiplog.report.evaluation import tables
from shiplog.report.evaluation.judgement import MEANING, Judgement, force_line, judge
from shiplog.report.result import Printed
from shiplog.training.runs.load_model import Run
from shiplog.voyages.store import contradicted
from shiplog.voyages.store.contradicted import Contradicted


@dataclass(frozen=True, repr=False)
class Evaluation(Printed):
    """Every run and both baselines on the same measured windows.

    errors     one row per run, seed and window: voyage, elapsed [s], loss (L, Eq. 8 of Wakita et
               al. 2024), RMSE of surge and sway [m/s] and yaw rate [rad/s], how far off the end is
               [m], [deg], and wind_speed (mean apparent, m/s)
    rollouts   one row per run, seed, voyage, window and second: time [s into the voyage], the
               simulated state (m, m/s, rad, rad/s) and the error d of Eq. 5
    coverage   one row per window: share of its seconds inside the first run's training data,
               outside_<channel>, reason
    baseline_losses  L of every window [N]: of holding the velocity, and of quadratic least
               squares on the first run's data
    inside     run, channel, share: of the samples inside the 90 % band, where a run has one
    forces     of the first physical run along the voyages, as ComparisonData has them; or None
    datums     voyage → latitude and longitude [deg] of its x₀ = y₀ = 0, where its log had them
    contradicted   what was recorded on these voyages and contradicts itself
    """

    runs: tuple[Run, ...]
    voyages: tuple[str, ...]
    too_short: tuple[str, ...]
    rows: pl.DataFrame
    errors: pl.DataFrame
    rollouts: pl.DataFrame
    coverage: pl.DataFrame
    baseline_losses: dict[str, np.ndarray]
    inside: pl.DataFrame
    forces: pl.DataFrame | None
    contradicted: tuple[Contradicted, ...] = ()
    datums: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    @property
    def json(self) -> dict:
        """The contract's JSON: of one run its own, of several that of each by its name."""
        answers = {run.name: self.answer(run) for run in self.runs}
        return (
            answers.popitem()[1] if len(answers) == 1 else {"contract": CONTRACT, "runs": answers}
        )

    def answer(self, run: Run) -> dict:
        """The contract's JSON for one run, the share of samples inside its 90 % band, and the
        voyages that have no window."""
        errors = self.errors.filter(pl.col("run") == run.name)
        answer = tables.evaluation_json(errors, self.means, self.coverage)
        shares = self.inside.filter(pl.col("run") == run.name).select("channel", "share")
        judged = self.judgement(run)
        return answer | {
            "too_short": list(self.too_short),
            "sentence": f"{self.warning} {judged.sentence}".strip(),
            "contradictions": [one.as_json() for one in self.contradicted],
            "judgement": judged.as_json(),
            "band_90": dict(shares.iter_rows()),
            "winds": tables.winds(errors).drop("run").to_dicts(),
        }

    @property
    def warning(self) -> str:
        """What comes first where the voyages cannot be right; else empty."""
        return contradicted.text(self.contradicted)

    @property
    def means(self) -> dict[str, float]:
        """Mean L of each baseline."""
        return {name: float(values.mean()) for name, values in self.baseline_losses.items()}

    def judgement(self, run: Run) -> Judgement:
        """One run against both baselines, and its errors in lengths of the ship."""
        errors = self.errors.filter(pl.col("run") == run.name)
        length = self.runs[0].profile.ship.length_m
        return judge(run.name, errors, self.baseline_losses, length, self.runs[0].config.window)

    @property
    def lines(self) -> list[str]:
        """Markdown: a sentence a run, models and baselines, voyages, the worst windows of the
        first run."""
        answers = {f"{run.name}: {run.label}": self.answer(run) for run in self.runs}
        first = next(iter(answers.values()))
        errors = self.errors.filter(pl.col("run") == self.runs[0].name)
        count = counted(first["windows"], "window")
        lines = [
            *([self.warning] if self.warning else []),
            *[self.judgement(run).sentence for run in self.runs],
            "",
            f"{MEANING} Means over {count} and over seeds:",
            "",
            tables.models_table(answers, self.means, self.runs[0].name),
            "",
            *tables.band_lines(self.inside),
            f"Per voyage, {self.runs[0].name}:",
            "",
            tables.voyages_table(first),
            "",
            *tables.wind_lines(self.errors),
            "Worst windows, and whether the training data had been there:",
            "",
            tables.windows_table(errors, self.coverage),
        ]
        if len(self.voyages) == 1 and self.forces is not None:
            lines += ["", force_line(self.forces, self.voyages[0])]
        if self.too_short:
            lines += ["", f"Without a window of that length: {listed(self.too_short)}."]
        return lines
