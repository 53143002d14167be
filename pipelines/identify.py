"""Voyages to an identified physical model: parameters, held-out voyages, the hybrid's network."""

from __future__ import annotations

import fnmatch
import logging
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl

from pipelines.prepare import seconds
from pipelines.provenance import Answer, provenance
from pipelines.split import choose_physical_split, plan, refuse_shared_rows, say
from shiplog import band, identifiability, identify, report, residual, runs, table, windows
from shiplog import seeds as streams
from shiplog.config import Config
from shiplog.crossvalidation import CrossValidated, cross_validate
from shiplog.exceptions import RunError, WindowError, listed, nearest
from shiplog.findings import CONTRACT
from shiplog.identify import Identified
from shiplog.models import mmg
from shiplog.profile import Profile
from shiplog.runs import Run
from shiplog.sensitivity import Series, Simulator, losses, rollout, series
from shiplog.store import Store
from shiplog.windows import AUGMENTATIONS

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Prepared:
    """One ship's equations, starting values and training windows.

    voyages, days   [N]  group of each window; the same data under two names is one voyage
    """

    model: mmg.MMG
    start: mmg.Parameters
    data: Series
    voyages: list[str]
    days: list[str]
    free: np.ndarray


def identify_run(
    config: Config, store: Store, out: Path, parameters: Path | None = None
) -> tuple[Run, list[str]]:
    """Identify a physical model, hold voyages out, save the run and say what was found.

    Raises ShiplogError.
    """
    split, began = config.split, time.time()
    used = [*split.training, *split.validation]
    profile = store.profile(used)
    rows = seconds(store, used, profile)
    refuse_shared_rows(rows, split)
    learnt = rows.filter(pl.col("voyage").is_in(split.training))
    held = rows.filter(pl.col("voyage").is_in(split.validation))
    planned = plan(learnt, config.data, config.window)
    ready = prepare(config, profile, learnt, planned, parameters)
    if config.model == "hybrid" and len(set(ready.voyages)) < 2 and not held.height:
        raise RunError(
            "A hybrid needs a voyage to hold out: its network is not trusted otherwise.",
            hint="name a second voyage with --voyages, or one with --validation.",
        )
    config = config.model_copy(
        update={
            "physics": config.physics.model_copy(
                update={"parameters": ready.start.source, "substeps": ready.model.substeps}
            )
        }
    )
    run = runs.create(out, config, profile, None, planned, learnt, held)
    count = int(ready.free.sum()) if config.physics.fit else 0
    log.info(
        "%s: %d of %d parameters free, %d windows of %s; they start from %s",
        run.label, count, len(ready.start.names), len(ready.voyages), listed(split.training),
        ready.start.source,
    )  # fmt: skip
    if not config.physics.fit:
        said = _keep(run, ready)
        return run.finish(provenance(store, split, began)), said

    kept: dict[bytes, Identified] = {}

    def refit(part: Series) -> Identified:
        """The physics without some windows: asked for again by every strength of a network."""
        key = part.weight.tobytes()
        if key not in kept:
            kept[key] = _physics(ready, part)
        return kept[key]

    found = refit(ready.data)
    before = losses(ready.model, ready.start.values, ready.data)
    by_voyage = cross_validate(
        lambda part: _simulator(ready.model, refit(part)),
        ready.data, ready.voyages, config.physics.folds,
    )  # fmt: skip
    by_day = None
    if len(set(ready.days)) > 1 and _apart(ready.days, ready.voyages):
        by_day = cross_validate(
            lambda part: _simulator(ready.model, refit(part)),
            ready.data, ready.days, config.physics.folds,
        )  # fmt: skip
    said = [_sentence("training windows", before, losses(ready.model, found.values, ready.data))]
    said += [
        _sentence(f"windows of held-out {name}", before, one.loss)
        for name, one in (("voyages", by_voyage), ("days", by_day))
        if one is not None
    ]
    if by_voyage is None:
        said.append("One voyage only: nothing could be held out, so the gain is not tested.")
    said += identifiability.note(
        found, ready.start.names, ready.start.spread, (ready.start.low, ready.start.high),
        mmg.meaning,
    )  # fmt: skip
    validated = by_voyage
    for seed in config.seeds:
        if config.model == "hybrid":
            sentence, validated = _hybrid(run, ready, refit, by_voyage, held, seed)
            said.append(sentence)
        else:
            save(run, seed, ready, _simulator(ready.model, found), found)
    if by_voyage is not None:
        _save_cross_validation(run, before, by_voyage, by_day)
    _band(run, ready, held, validated)
    return run.finish(provenance(store, split, began)), said


def prepare(
    config: Config,
    profile: Profile,
    learnt: pl.DataFrame,
    planned: pl.DataFrame,
    parameters: Path | None,
) -> Prepared:
    """Equations, starting values and windows of a run. Raises ProfileError or WindowError."""
    off = config.physics.without
    ship, main, estimates = mmg.geometry_of(profile, off)
    for sentence in estimates:
        log.info(sentence)
    path = parameters or mmg.beside(profile.source)
    start = mmg.load(path, ship, off) if path else mmg.estimated(ship, main)
    if path is None:
        log.info("no published coefficients for this ship: %s", start.source)
    names = (profile.actuator_names, profile.wind_names)
    cut = windows.cut(learnt, planned, config.window, *names)
    if planned.height == 0:
        raise WindowError(
            f"No window of {config.window} s in {listed(config.split.training)}.",
            hint="choose a shorter --window.",
        )
    twin: dict[str, str] = {}
    for left, right, _ in table.shared_rows(learnt).iter_rows():
        twin[str(right)] = twin.get(str(left), str(left))
    first = dict(
        learnt.group_by("voyage").agg(pl.col("time").min().dt.strftime("%Y-%m-%d")).iter_rows()
    )
    voyages = [twin.get(name, name) for name in map(str, cut.plan["voyage"])]
    data = series(cut)
    model = _stable(mmg.MMG(ship, config.physics.substeps), start.values, data)
    return Prepared(
        model, start, data, voyages, [first[v] for v in voyages],
        _free(config.physics.free, start.names),
    )  # fmt: skip


def _stable(model: mmg.MMG, values: np.ndarray, data: Series) -> mmg.MMG:
    """With as many Euler steps a second as a small, quick ship needs to hold every window."""
    for substeps in (1, 2, 4, 8):
        finer = mmg.MMG(model.geometry, max(substeps, model.substeps))
        if np.isfinite(losses(finer, values, data)).all():
            if finer.substeps > model.substeps:
                log.info("%d Euler steps within each second keep the ship stable", finer.substeps)
            return finer
    return model  # the identification says what is wrong


def save(
    run: Run,
    seed: int,
    ready: Prepared,
    simulator: Simulator,
    found: Identified | None,
    fixed: dict[str, np.ndarray] | None = None,
) -> None:
    """One seed's numbers, for machines and as a TOML that --parameters takes."""
    start, count = ready.start, len(ready.start.names)
    values = simulator.theta[:count]
    source = f"identified by shiplog in {run.name}" if found else start.source
    error = found.standard_error[:count] if found else np.zeros(count)
    free = found.free[:count] if found else np.zeros(count, dtype=bool)
    entries = [start.entry(name) for name in start.names]
    identified = pl.DataFrame(
        {
            "name": start.names,
            "symbol": [e.symbol for e in entries],
            "meaning": [e.meaning for e in entries],
            "unit": [e.unit for e in entries],
            "start": start.values,
            "spread": start.spread,
            "value": values,
            "standard_error": error,
            "free": free,
        }
    )
    toml = start.with_values(values, source).to_toml()
    run.save_simulator(seed, simulator, fixed or {}, toml, identified)


def _apart(days: list[str], voyages: list[str]) -> bool:
    """Whether days are other groups than voyages: some day holds several."""
    return len(set(zip(days, voyages, strict=True))) > len(set(days))


def _keep(run: Run, ready: Prepared) -> list[str]:
    """A run of the starting values as they are; their errors here no fit has seen."""
    nothing = np.zeros((len(ready.start.values),) * 2)
    simulator = Simulator(ready.model, ready.start.values, nothing)
    for seed in run.config.seeds:
        save(run, seed, ready, simulator, None)
    states = rollout(ready.model, ready.start.values, ready.data)
    error = states - ready.data.measured
    run.save_band(band.calibrate(error, np.zeros_like(states), len(set(ready.voyages))))
    loss = losses(ready.model, ready.start.values, ready.data)
    return [f"Mean L {loss.mean():.0f} over the {len(loss)} windows named, with nothing fitted."]


def _physics(ready: Prepared, part: Series) -> Identified:
    return identify.identify(
        ready.model,
        ready.start.values,
        ready.start.spread,
        part,
        bounds=(ready.start.low, ready.start.high),
        free=ready.free,
    )


def _hybrid(
    run: Run,
    ready: Prepared,
    refit: Callable[[Series], Identified],
    by_voyage: CrossValidated | None,
    held: pl.DataFrame,
    seed: int,
) -> tuple[str, CrossValidated | None]:
    """Choose how much the network may say on voyages it has not seen, then fit it on all."""
    settings, found = run.config.physics, refit(ready.data)

    def fitted(part: Series, physics: Identified, strength: float) -> tuple[Simulator, Identified]:
        model, done = residual.fit(
            ready.model, physics, part,
            width=settings.width, strength=strength,
            rng=np.random.default_rng(streams.generator(seed, "residual").initial_seed()),
        )  # fmt: skip
        return Simulator(model, done.values, done.covariance), done

    judged: dict[float, list[np.ndarray]] = {s: [] for s in (0.0, *settings.strengths)}
    validated: dict[float, CrossValidated | None] = {0.0: by_voyage}
    if by_voyage is not None:
        judged[0.0].append(by_voyage.loss)
        for strength in settings.strengths:
            one = cross_validate(
                lambda part, s=strength: fitted(part, refit(part), s)[0],
                ready.data, ready.voyages, settings.folds,
            )  # fmt: skip
            assert one is not None
            validated[strength] = one
            judged[strength].append(one.loss)
    candidates = {}
    if held.height:
        names = (run.profile.actuator_names, run.profile.wind_names)
        size = run.config.window
        unseen = series(windows.cut(held, plan(held, "ref", size), size, *names))
        judged[0.0].append(losses(ready.model, found.values, unseen))
        for strength in settings.strengths:
            candidates[strength] = fitted(ready.data, found, strength)
            simulator, _ = candidates[strength]
            judged[strength].append(losses(simulator.model, simulator.theta, unseen))
    whole = {strength: np.concatenate(parts) for strength, parts in judged.items()}
    best = residual.choose(whole)
    for strength, loss in whole.items():
        log.info("network of strength %g: L %.0f on held-out windows", strength, loss.mean())
    if best == 0.0:
        # A silent network: the physics as they are, in the hybrid's form.
        simulator, done = fitted(ready.data, found, 1e-9)
        said = "The network adds nothing that survives held-out windows: it is kept silent."
    else:
        simulator, done = candidates.get(best) or fitted(ready.data, found, best)
        said = (
            f"Network of strength {best:g}: L {whole[best].mean():.0f} on {len(whole[best])} "
            f"held-out windows, physics alone {whole[0.0].mean():.0f}."
        )
    net = simulator.model.residual  # type: ignore[attr-defined]  # of a Hybrid, as `fitted` made it
    fixed = {n: getattr(net, n) for n in ("mean", "std", "bound", "anchors", "radius", "limit")}
    save(run, seed, ready, simulator, done, fixed)
    return f"Seed {seed}: {said}", validated.get(best)


def _simulator(model: mmg.MMG, found: Identified) -> Simulator:
    return Simulator(model, found.values, found.covariance)


def _band(run: Run, ready: Prepared, held: pl.DataFrame, validated: CrossValidated | None) -> None:
    """Learn the band on every voyage that was held out: in turn, and those for validation."""
    errors, spreads, groups = [], [], 0
    if validated is not None:
        errors.append(validated.states - ready.data.measured)
        spreads.append(validated.spread)
        groups += len(set(ready.voyages))
    if held.height:
        names = (run.profile.actuator_names, run.profile.wind_names)
        unseen = windows.cut(held, plan(held, "ref", run.config.window), run.config.window, *names)
        simulator = run.simulator(run.config.seeds[0])
        errors.append((simulator.simulate(unseen) - unseen.state).numpy())
        spreads.append(simulator.spread(unseen))
        groups += unseen.plan["voyage"].n_unique()
    if errors:
        run.save_band(band.calibrate(np.concatenate(errors), np.concatenate(spreads), groups))


def _save_cross_validation(
    run: Run, before: np.ndarray, by_voyage: CrossValidated, by_day: CrossValidated | None
) -> None:
    parts = [
        pl.DataFrame(
            {
                "held_out": [name] * len(before),
                "group": one.groups,
                "window": np.arange(len(before)),
                "start": before,
                "loss": one.loss,
            }
        )
        for name, one in (("voyages", by_voyage), ("days", by_day))
        if one is not None
    ]
    run.save_cross_validation(pl.concat(parts))


def _sentence(where: str, before: np.ndarray, after: np.ndarray) -> str:
    share = after.mean() / before.mean()
    return (
        f"Mean L over {len(before)} {where}: {before.mean():.0f} at the start, "
        f"{after.mean():.0f} identified ({share:.3f})."
    )


def _free(patterns: Sequence[str], names: tuple[str, ...]) -> np.ndarray:
    """Which parameters may move. Raises RunError for a pattern that none has."""
    if not patterns:
        return np.ones(len(names), dtype=bool)
    for pattern in patterns:
        if not fnmatch.filter(names, pattern):
            raise RunError(
                f"No parameter is called {pattern!r}{nearest(pattern, names)}.",
                hint=f"--free takes names or patterns such as 'wind.*': {listed(names, most=99)}.",
            )
    return np.array([any(fnmatch.fnmatch(n, p) for p in patterns) for n in names])


def identify_command(
    store_path: Path,
    out: Path,
    *,
    model: str,
    data: str,
    voyages: Sequence[str],
    validation: Sequence[str],
    seeds: int,
    window: int,
    fit: bool,
    parameters: Path | None,
    without: Sequence[str],
    free: Sequence[str],
) -> Answer:
    """`shiplog train --model mmg|hybrid`."""
    if model == "hybrid" and not fit:
        raise RunError(
            "A hybrid's network has to be fitted.", hint="--no-fit goes with --model mmg."
        )
    if model == "mmg" and seeds > 1:
        log.info("an identification draws nothing: one seed stands for all")
        seeds = 1
    if AUGMENTATIONS[data].copies:
        raise RunError(
            f"--data {data} is of noisy copies, which an identification has no use for.",
            hint="choose ref, sli2, sli10 or d-ref.",
        )
    store = Store(store_path)
    split = choose_physical_split(store, voyages, validation, data, window)
    say(split)
    config = Config.model_validate(
        {
            "model": model,
            "data": data,
            "window": window,
            "split": split,
            "seeds": tuple(range(seeds)),
            "physics": {"fit": fit, "without": tuple(without), "free": tuple(free)},
        }
    )
    run, said = identify_run(config, store, out, parameters)
    identified = run.identified()
    lines = [f"{run.label} in {run.path}.", *said, ""]
    if fit:
        lines += [report.parameters_table(identified), ""]
    lines.append(f"Next: shiplog evaluate {run.path} --store {store_path}")
    content = {
        "contract": CONTRACT,
        "run": str(run.path),
        "label": run.label,
        "windows": run.windows().height,
        "notes": said,
        "parameters": identified.to_dicts(),
        "split": split.model_dump(mode="json"),
    }
    return Answer("\n".join(lines), content)
