"""Trained runs against measured voyages: errors, baselines, coverage, and the recording of both."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np
import polars as pl

from shiplog.commands.bars import reach, staged
from shiplog.exceptions import ShiplogError
from shiplog.machine.paths import refuse_same_names
from shiplog.machine.unexpected import unexpected
from shiplog.models.causes import user
from shiplog.nomenclature.channels import STATE, VELOCITY_IN_STATE
from shiplog.report.evaluation import derived
from shiplog.report.evaluation.evaluation import Evaluation
from shiplog.report.figures.plots import Plots
from shiplog.report.page import html
from shiplog.report.page.evaluation import page as evaluation_page
from shiplog.report.page.evaluation import source as sources
from shiplog.report.result import Shown
from shiplog.report.viewer.comparison_data import (
    BAND,
)
from shiplog.simulation import baselines, prediction_interval, scoring
from shiplog.simulation import coverage as covering
from shiplog.simulation.better_model import Better, better
from shiplog.simulation.residual_tests import MOST_ROWS, ResidualTest, residual_tests
from shiplog.simulation.rollout import simulate
from shiplog.training.runs import foreign_run, load_model, trust_file
from shiplog.training.runs.load_model import ForeignRun, Run
from shiplog.training.runs.run_checks import (
    refuse_no_window,
    refuse_other_columns,
    refuse_other_profile,
    refuse_other_window,
)
from shiplog.training.runs.voyages_to_test import held_back, say_twins
from shiplog.voyages.store import contradicted
from shiplog.voyages.store.store import Store
from shiplog.voyages.windows import ship_time, windows
from shiplog.voyages.windows.split import plan
from shiplog.voyages.windows.windows import Windows

WINDOWS_SHOWN = 2.0  # windows about a moment: one before it and one after

# seconds of the sample logs' test voyage
STAGES = {"reading": 1.0, "simulating": 3.0, "coverage": 1.0, "forces": 1.0, "trust": 2.0}


@staged("evaluating", STAGES)
def evaluate_runs(
    paths: Sequence[Path],
    store: Store,
    voyages: Sequence[str],
    cause_files: Sequence[Path] = (),
    simulators: Sequence[str] = (),
) -> Evaluation:
    """Roll every run's models out over the chosen voyages. Raises ShiplogError.

    cause_files   Python files of the causes of the user's own that are in these runs
    simulators    files of simulators of the user's own, of which some are
    """
    refuse_same_names(paths)
    causes = user.load(cause_files)
    opened = tuple(load_model.load(path, causes, simulators) for path in paths)
    first = opened[0]
    for other in opened[1:]:
        refuse_other_window(first, other)
        refuse_other_columns(first, other.profile.columns, other.name)
        refuse_other_profile(first, other.profile, other.name)
    names = held_back(opened, store, voyages)
    profile = store.profile(names)
    refuse_other_columns(first, profile.columns, "the chosen voyages")
    refuse_other_profile(first, profile, "the chosen voyages")
    rows = store.seconds(names, profile)
    for run in opened:
        say_twins(run, rows)
    size = first.config.window
    planned = plan(rows, "ref", size)
    refuse_no_window(first, names, planned)
    cut = windows.cut(rows, planned, size, profile.actuator_names, profile.wind_names)
    numbered = _numbered(cut)
    reach("simulating")
    scored, bands = [], {}
    for run in opened:
        models = run.models()
        scores = {seed: scoring.score(model, cut) for seed, model in models.items()}
        scored += [(run, seed, one) for seed, one in scores.items()]
        bands[run.name] = _half_widths(run, models, scores, cut)
    for run, _, one in scored:
        if isinstance(run, ForeignRun):
            foreign_run.refuse_no_ship(run, one.errors["loss"].to_numpy(), cut)
    reach("coverage")
    covered = _coverage(first, rows, numbered, size)
    reach("forces")
    forces = _forces(opened, rows)
    reach("trust")
    found = Evaluation(
        runs=opened,
        voyages=tuple(names),
        too_short=tuple(sorted(set(names) - set(cut.plan["voyage"]))),
        rows=rows,
        errors=pl.concat(
            [_labelled(numbered, run, seed).hstack(s.errors) for run, seed, s in scored]
        ),
        rollouts=pl.concat(
            [_rollout(numbered, cut, run, seed, s, bands[run.name]) for run, seed, s in scored]
        ),
        coverage=covered,
        baseline_losses=_baseline_losses(first, cut),
        inside=_inside(scored, bands, cut),
        forces=forces,
        trust={run.name: trust_file.of_run(run) for run in opened},
        residual_tests={run.name: _residual_tests(run, rows) for run in opened},
        better=_better(opened, scored, cut),
        contradicted=contradicted.list_contradicted(store, names),
        datums={name: found for name in names if (found := store.origin(name)[1]) is not None},
        ship_time=ship_time.of(first.profile.ship.length_m, first.training()),
        derived=derived.together(store.report(_whole(store, name)) for name in names),
    )
    return replace(found, shown=_shown(found, store))


def _whole(store: Store, name: str) -> str:
    """The voyage that a name is of, or is a part of."""
    part = store.part_of(name)
    return name if part is None else part.whole


def _shown(found: Evaluation, store: Store) -> Shown:
    """Pictures and page, once they are asked for."""

    def plots() -> Plots:
        return Plots(sources.of_evaluation(found, store).content)

    def page() -> str:
        return html.render(evaluation_page.of_source(sources.of_evaluation(found, store)))

    return Shown(plots, page)


def save(evaluation: Evaluation) -> tuple[ShiplogError, ...]:
    """errors.parquet and rollouts.parquet into each run's folder. Returns what the system says of
    a folder that cannot be written, such as a colleague's: the evaluation is good all the same."""
    refused = []
    for run in evaluation.runs:
        mine = pl.col("run") == run.name
        try:
            run.save_evaluation(evaluation.errors.filter(mine), evaluation.rollouts.filter(mine))
        except OSError as error:
            refused.append(unexpected(error))
    return tuple(refused)


def write_page(evaluation: Evaluation, store: Store, path: Path) -> None:
    from shiplog.report.page import html
    from shiplog.report.page.evaluation import page as evaluation_page
    from shiplog.report.page.evaluation import source as sources

    html.write(evaluation_page.of_source(sources.of_evaluation(evaluation, store)), path)


def keep_pages(evaluation: Evaluation, store: Store, page: Path | None) -> tuple[ShiplogError, ...]:
    """What `shiplog report RUN` makes its page of, in the folder of a run that was evaluated alone;
    and the page, where one is asked for. Returns what could not be written."""
    refused = []
    source = sources.of_evaluation(evaluation, store)
    if len(evaluation.runs) == 1:
        try:
            sources.save(source, evaluation.runs[0].path / sources.FOLDER)
        except OSError as error:
            refused.append(unexpected(error))
    if page is not None:
        try:
            html.write(evaluation_page.of_source(source), page)
        except ShiplogError as error:
            refused.append(error)
    return tuple(refused)


def _numbered(cut: Windows) -> pl.DataFrame:
    """voyage, window (counted in each voyage), segment, start, elapsed, wind_speed."""
    return cut.plan.select(
        "voyage",
        pl.int_range(pl.len()).over("voyage").alias("window"),
        "segment",
        "start",
        "elapsed",
    ).with_columns(
        wind_speed=pl.Series(
            values=cut.wind[..., 0].mean(1) if cut.wind.shape[-1] else [None] * len(cut),
            dtype=pl.Float64,
        )
    )


def _labelled(numbered: pl.DataFrame, run: Run, seed: int) -> pl.DataFrame:
    return numbered.select(
        pl.lit(run.name).alias("run"),
        pl.lit(seed).alias("seed"),
        "voyage",
        "window",
        "elapsed",
        "wind_speed",
    )


def _half_widths(
    run: Run, models: dict, scores: dict[int, scoring.Scores], cut: Windows
) -> np.ndarray | None:
    """[N, I, 6] of the run's 90 % band: of its parameters' spread or of its seeds'."""
    learnt = run.band()
    if learnt is None or len(learnt.growth) != cut.state.shape[1]:
        return None
    simulated = [one.simulated for one in scores.values()]
    return learnt.half_width(run.spread(models, simulated, cut))


def _inside(scored: list, bands: dict[str, np.ndarray | None], cut: Windows) -> pl.DataFrame:
    """run, channel, share of the samples of all seeds inside the band."""
    rows = []
    for run in dict.fromkeys(run.name for run, _, _ in scored):
        half = bands[run]
        if half is None:
            continue
        shares = np.mean(
            [
                prediction_interval.coverage(s.simulated - cut.state, half)
                for r, _, s in scored
                if r.name == run
            ],
            axis=0,
        )
        rows += [(run, c.name, float(shares[i])) for i, c in enumerate(STATE)]
    schema = {"run": pl.String, "channel": pl.String, "share": pl.Float64}
    return pl.DataFrame(rows, schema=schema, orient="row")


def _residual_tests(run: Run, rows: pl.DataFrame) -> tuple[ResidualTest, ...]:
    """Of what the first seed leaves over in one second, at every pair of neighbouring rows."""
    pairs = windows.plan(rows.lazy(), 2, 1).head(MOST_ROWS).collect()
    if not pairs.height:
        return ()
    profile = run.profile
    cut = windows.cut(rows, pairs, 2, profile.actuator_names, profile.wind_names)
    simulated = simulate(run.models()[run.config.seeds[0]], cut)
    errors = (cut.state - simulated)[:, 1, list(VELOCITY_IN_STATE)]
    inputs = {name: cut.actuator[:, 0, i] for i, name in enumerate(profile.actuator_names)}
    if profile.has_wind:
        speed, angle = cut.wind[:, 0, 0], cut.wind[:, 0, 1]
        inputs |= {"wind_ahead": speed * np.cos(angle), "wind_athwart": speed * np.sin(angle)}
    stretch = pairs.select(pl.struct("voyage", "segment").rank("dense"))["voyage"].to_numpy()
    return residual_tests(errors, stretch, inputs)


def _better(
    opened: Sequence[Run], scored: Sequence[tuple[Run, int, scoring.Scores]], cut: Windows
) -> tuple[Better, ...]:
    """Every pair of runs, the one with the smaller L first, on the means of their seeds."""
    if len(opened) < 2:
        return ()
    losses = {
        run.name: np.mean([s.errors["loss"].to_numpy() for r, _, s in scored if r is run], axis=0)
        for run in opened
    }
    expected = {run.name: _expected(run) for run in opened}
    voyages = cut.plan["voyage"].to_list()
    pairs = [
        better((a, b), (losses[a], losses[b]), voyages, (expected[a], expected[b]))
        for a, b in combinations(sorted(losses, key=lambda name: losses[name].mean()), 2)
    ]
    return tuple(one for one in pairs if one is not None)


def _expected(run: Run) -> np.ndarray | None:
    """L of windows that the run itself was tested on: each training window without its voyage, or
    those of the validation voyages; None without either."""
    if (known := run.cross_validation()) is not None:
        return known.filter(pl.col("held_out") == "voyages")["loss"].to_numpy()
    held, size = run.validation(), run.config.window
    planned = plan(held, "ref", size) if held.height else held
    if not planned.height:
        return None
    cut = windows.cut(held, planned, size, run.profile.actuator_names, run.profile.wind_names)
    scores = [scoring.score(model, cut) for model in run.models().values()]
    return np.mean([one.errors["loss"].to_numpy() for one in scores], axis=0)


def _forces(opened: tuple[Run, ...], rows: pl.DataFrame) -> pl.DataFrame | None:
    for run in opened:
        if (found := run.forces(rows)) is not None:
            return found.with_columns(pl.lit(run.name).alias("run"))
    return None


def _rollout(
    numbered: pl.DataFrame,
    cut: Windows,
    run: Run,
    seed: int,
    scores: scoring.Scores,
    half: np.ndarray | None,
) -> pl.DataFrame:
    count, size, _ = scores.simulated.shape
    since = np.concatenate((np.zeros((count, 1)), np.cumsum(cut.dt, 1)), 1)
    every = pl.Series("row", range(count)).repeat_by(size).explode()
    index = _labelled(numbered, run, seed)[every.to_list()]
    states = scores.simulated.reshape(-1, len(STATE))
    return index.select("run", "seed", "voyage", "window").hstack(
        pl.DataFrame(
            {"time": index["elapsed"].to_numpy() + since.ravel()}
            | {c.name: states[:, j] for j, c in enumerate(STATE)}
            | _edges(states, half)
            | {"d": scores.d.ravel()}
        )
    )


def _edges(states: np.ndarray, half: np.ndarray | None) -> dict[str, pl.Series]:
    """<channel>_low and _high of the 90 % band; without one, nulls."""
    wide = None if half is None else half.reshape(-1, len(STATE))
    edges = {}
    for j, c in enumerate(STATE):
        for suffix, sign in zip(BAND, (-1.0, 1.0), strict=True):
            at = None if wide is None else states[:, j] + sign * wide[:, j]
            edges[c.name + suffix] = pl.Series(
                values=[None] * len(states) if at is None else at, dtype=pl.Float64
            )
    return edges


def _coverage(run: Run, rows: pl.DataFrame, numbered: pl.DataFrame, size: int) -> pl.DataFrame:
    covered = covering.learn(run.training(), run.profile.actuator_names, run.profile.has_wind)
    measured = covered.table(rows, numbered, size)
    whole = numbered.hstack(measured)
    reasons = []
    for row in whole.to_dicts():
        within = rows.filter(
            (pl.col("voyage") == row["voyage"])
            & pl.col("elapsed").is_between(row["elapsed"], row["elapsed"] + size - 1)
        )
        reasons.append(covering.reason(row, within))
    return whole.drop("segment", "start", "elapsed", "wind_speed").with_columns(
        reason=pl.Series(reasons)
    )


def _baseline_losses(run: Run, cut: Windows) -> dict[str, np.ndarray]:
    """L of both baselines on the same windows [N]; one is fitted to the run's training data."""
    size = run.config.window
    names = (run.profile.actuator_names, run.profile.wind_names)
    learnt = windows.cut(run.training(), plan(run.training(), "ref", size), size, *names)
    fitted = baselines.least_squares(learnt)
    return {
        name: scoring.score(model, cut).errors["loss"].to_numpy()
        for name, model in (("hold", baselines.hold), ("least_squares", fitted))
    }
