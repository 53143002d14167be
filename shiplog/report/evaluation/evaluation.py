"""The result of `shiplog evaluate`: errors of runs on the same test windows, their sentences,
tables and JSON."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
import polars as pl

from shiplog.exceptions import RunNotEvaluated, SeveralRuns, listed
from shiplog.logs.health.health_report import DerivedChannel
from shiplog.models import FOREIGN
from shiplog.nomenclature.contract import CONTRACT
from shiplog.nomenclature.numbers import counted, figure
from shiplog.report.evaluation import derived, tables
from shiplog.report.evaluation import trust as trusted
from shiplog.report.evaluation.judgement import MEANING, Judgement, force_line, judge
from shiplog.report.result import Shown, Shows
from shiplog.simulation.better_model import Better
from shiplog.simulation.foreign_model import sentences
from shiplog.simulation.residual_tests import ResidualTest
from shiplog.training.physics.trust import CoefficientTrust
from shiplog.training.runs.load_model import Run
from shiplog.voyages.store import contradicted
from shiplog.voyages.store.contradicted import Contradicted
from shiplog.voyages.windows.ship_time import ShipTime

MOST_FAILURES = 5  # of a simulator, that are listed


@dataclass(frozen=True)
class RunScores:
    """How far off one run is on the windows of an evaluation.

    loss             L (Eq. 8 of Wakita et al. 2024): mean over windows, then over seeds
    seeds            L of each seed
    rmse             surge, sway [m/s], yaw_rate [rad/s]
    end_position_m   mean distance at the end of a window [m]
    end_heading_deg  mean error of the heading there [deg]
    voyages          voyage → loss, windows, coverage (0 to 1)
    band_90          channel → share of the samples inside the run's 90 % band
    judgement        against both baselines with 90 % intervals, and medians in lengths of the ship
    """

    run: str
    loss: float
    seeds: tuple[float, ...]
    windows: int
    rmse: dict[str, float]
    end_position_m: float
    end_heading_deg: float
    voyages: dict[str, dict[str, float]]
    band_90: dict[str, float]
    judgement: Judgement

    @property
    def sentence(self) -> str:
        return self.judgement.sentence


@dataclass(frozen=True, repr=False)
class Evaluation(Shows):
    """Every run and both baselines on the same measured windows.

    `evaluation["mmg"]` is a run's `RunScores`, and `for scores in evaluation` goes through them.
    Of one run they are attributes, too: `evaluation.loss`, `evaluation.rmse`.

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
    derived        channels of these voyages that no instrument measured
    contradicted   what was recorded on these voyages and contradicts itself
    ship_time      L/U of the first run's training voyages
    shown          its pictures and its page
    trust          run → what may be believed of each coefficient, by its training voyages; empty
                   of a network
    residual_tests run → tests of what it leaves over in one second, on these voyages
    better         of every pair of runs, P that the first is better on new voyages
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
    ship_time: ShipTime | None = None
    derived: tuple[DerivedChannel, ...] = ()
    shown: Shown | None = None
    trust: Mapping[str, tuple[CoefficientTrust, ...]] = field(default_factory=dict)
    residual_tests: Mapping[str, tuple[ResidualTest, ...]] = field(default_factory=dict)
    better: tuple[Better, ...] = ()

    def __getitem__(self, run: str) -> RunScores:
        """One run's scores, by its name. Raises RunNotEvaluated."""
        for one in self.runs:
            if one.name == run:
                return self._scores(one)
        raise RunNotEvaluated(run, [one.name for one in self.runs])

    def __iter__(self) -> Iterator[RunScores]:
        return (self._scores(run) for run in self.runs)

    def __len__(self) -> int:
        return len(self.runs)

    def _scores(self, run: Run) -> RunScores:
        found = self.answer(run)
        kept = ("loss", "windows", "rmse", "end_position_m", "end_heading_deg", "voyages")
        return RunScores(
            run=run.name, seeds=tuple(found["seeds"]), band_90=found["band_90"],
            judgement=self.judgement(run), **{key: found[key] for key in kept},
        )  # fmt: skip

    def _of_one(self, what: str) -> Any:
        """Of the one run that was evaluated. Raises SeveralRuns where there are more."""
        first, *others = self.runs
        if others:
            raise SeveralRuns(what, [run.name for run in self.runs])
        return getattr(self._scores(first), what)

    @property
    def loss(self) -> float:
        """Mean L of the run. Of several runs: `evaluation["mmg"].loss`."""
        return self._of_one("loss")

    @property
    def rmse(self) -> dict[str, float]:
        """RMSE of the run: surge, sway [m/s], yaw_rate [rad/s]."""
        return self._of_one("rmse")

    @property
    def end_position_m(self) -> float:
        """Mean distance of the run at the end of a window [m]."""
        return self._of_one("end_position_m")

    @property
    def end_heading_deg(self) -> float:
        """Mean error of the run's heading at the end of a window [deg]."""
        return self._of_one("end_heading_deg")

    @property
    def baselines(self) -> dict[str, float]:
        """Mean L of `hold` (the velocity is held) and of `least_squares` (quadratic)."""
        return self.means

    @property
    def windows(self) -> int:
        """On which every run was scored."""
        return len(next(iter(self.baseline_losses.values())))

    @property
    def summary(self) -> pl.DataFrame:
        """One row a run and baseline: name, loss, rmse_surge, rmse_sway [m/s], rmse_yaw_rate
        [rad/s], end_position_m, end_heading_deg, share_of_hold, share_of_least_squares."""
        rows = []
        for one in self:
            shares = {a.baseline: a.share for a in one.judgement.against}
            rows.append(
                {"name": one.run, "loss": one.loss}
                | {f"rmse_{key}": value for key, value in one.rmse.items()}
                | {"end_position_m": one.end_position_m, "end_heading_deg": one.end_heading_deg}
                | {f"share_of_{name}": shares.get(name) for name in self.baselines}
            )
        nothing = dict.fromkeys(rows[0])
        rows += [nothing | {"name": key, "loss": loss} for key, loss in self.baselines.items()]
        schema = {name: pl.String if name == "name" else pl.Float64 for name in rows[0]}
        return pl.DataFrame(rows, schema)

    def __repr__(self) -> str:
        losses = ", ".join(f"{one.run} L {figure(one.loss, 3)}" for one in self)
        on = f"{counted(self.windows, 'window')} of {listed(self.voyages, most=3)}"
        than = ", ".join(f"{name} {figure(loss, 3)}" for name, loss in self.baselines.items())
        return f"Evaluation({losses}; {than}; {on})"

    @property
    def json(self) -> dict:
        """The contract's JSON: of one run its own, of several that of each by its name."""
        answers = {run.name: self.answer(run) for run in self.runs}
        if len(answers) == 1:
            return answers.popitem()[1]
        better = [one.as_json() for one in self.better]
        return {"contract": CONTRACT, "runs": answers, "better": better}

    def answer(self, run: Run) -> dict:
        """The contract's JSON for one run, the share of samples inside its 90 % band, and the
        voyages that have no window."""
        errors = self.errors.filter(pl.col("run") == run.name)
        answer = tables.evaluation_json(errors, self.means, self.coverage)
        shares = self.inside.filter(pl.col("run") == run.name).select("channel", "share")
        judged = self.judgement(run)
        return (
            answer
            | {
                "too_short": list(self.too_short),
                "sentence": f"{self.warning} {judged.sentence}".strip(),
                "contradictions": [one.as_json() for one in self.contradicted],
                "judgement": judged.as_json(),
                "band_90": dict(shares.iter_rows()),
                "winds": tables.winds(errors).drop("run").to_dicts(),
                "trust": [one.as_json() for one in self.trust.get(run.name, ())],
                "residual_tests": [one.as_json() for one in self.residual_tests.get(run.name, ())],
            }
            | self._as_derived
            | self._failures(run)
        )

    @property
    def _as_derived(self) -> dict:
        """What was not measured, and what that adds to L; nothing where all was measured."""
        if not self.derived:
            return {}
        return {
            "derived": [asdict(one) for one in self.derived],
            "derived_loss": derived.expected_loss(self.derived, self._seconds),
        }

    @property
    def _seconds(self) -> float:
        """Of a window, from its first sample to its last."""
        return self.runs[0].config.window - 1.0

    @staticmethod
    def _failures(run: Run) -> dict:
        """Of a simulator of the user's own; nothing of all others."""
        if run.kind.family is not FOREIGN:
            return {}
        return {"failures": [asdict(one) for one in run.failures]}

    def failed(self, run: Run) -> list[str]:
        """Where a simulator of the user's own failed, in sentences; the first of them."""
        return sentences(run.config.foreign.name, run.failures)[:MOST_FAILURES]

    @property
    def window_advice(self) -> str:
        """A sentence where the length of the windows does not suit the ship; else empty."""
        if self.ship_time is None:
            return ""
        return self.ship_time.advice(self.runs[0].config.window)

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
    def trust_lines(self) -> list[str]:
        """What may be believed of each run's coefficients, and what its residuals show."""
        lines = []
        for run in self.runs:
            lines += trusted.coefficient_lines(run.name, self.trust.get(run.name, ()))
            lines += trusted.residual_lines(run.name, self.residual_tests.get(run.name, ()))
        return ["", *lines] if lines else []

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
            *[one for run in self.runs for one in self.failed(run)],
            *trusted.better_lines(self.better),
            *([self.window_advice] if self.window_advice else []),
            *([said] if (said := derived.loss_sentence(self.derived, self._seconds)) else []),
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
        lines += self.trust_lines
        if len(self.voyages) == 1 and self.forces is not None:
            lines += ["", force_line(self.forces, self.voyages[0])]
        if self.too_short:
            lines += ["", f"Without a window of that length: {listed(self.too_short)}."]
        return lines
