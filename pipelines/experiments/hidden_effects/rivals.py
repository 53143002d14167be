"""What simpler methods say of the same trial, with the same catalogue: the diagnosis' rivals.

python -m pipelines.experiments.hidden_effects.rivals BASE --store STORE --voyages 'trial_*'
    --json FILE

regression  what the measured acceleration is beyond the model's, regressed on each cause's columns;
            BIC decides (as Mangan, Kutz, Brunton & Proctor 2017, with our library of columns)
glr         rollouts of 30 s whose start is free, white noise alone: generalised likelihood ratios
linear      our own evidence where the trial was first linearised, and never again

Each ranks the causes and answers with the first or with none. `glr` and `linear` read the very pass
that the diagnosis begins with; nobody tells any of them what is hidden. A thruster that nobody
records has no columns: the diagnosis can name it, and these cannot.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.special import chdtri  # scipy.stats takes a second to load

from shiplog.diagnosis.hypotheses import as_it_stands, evidence
from shiplog.diagnosis.linear import measurement_correction, segments
from shiplog.diagnosis.linear.linear_segments import Linear
from shiplog.diagnosis.linear.parameter_layout import Columns
from shiplog.diagnosis.linear.segments import Cut
from shiplog.diagnosis.noise import likelihood, part_products
from shiplog.diagnosis.noise.likelihood import ProcessNoise
from shiplog.diagnosis.thresholds import SHOWS_NATS
from shiplog.diagnosis.trial.fitted import Point
from shiplog.diagnosis.trial.setup import trial_of
from shiplog.diagnosis.trial.trial import Trial
from shiplog.exceptions import RunError, ShiplogError
from shiplog.machine.jit_cache import traced
from shiplog.training.runs import load_model
from shiplog.voyages.rows import recording
from shiplog.voyages.rows.recording import Record
from shiplog.voyages.rows.timescale import BIN
from shiplog.voyages.store.store import Store

VELOCITY = [1, 3, 5]  # of channels.STATE
SURE = 0.999  # that nothing is named where nothing is hidden, if the noise were white
ROUNDS = 6  # of learning the white noise


@dataclass(frozen=True)
class Ranked:
    """One method's answer, and its scores of all causes [nats above none], best first."""

    answer: str | None
    scores: Mapping[str, float]

    def as_json(self) -> dict:
        ranking = [{"name": name, "score": score} for name, score in self.scores.items()]
        return {"answer": self.answer, "ranking": ranking}


def reported(scores: Mapping[str, float], wanted: Mapping[str, float] | float = 0.0) -> Ranked:
    """The first cause, where its score exceeds what is wanted of it."""
    order = dict(sorted(scores.items(), key=lambda pair: -pair[1]))
    first = next(iter(order), None)
    if first is None:
        return Ranked(None, order)
    least = wanted[first] if isinstance(wanted, Mapping) else wanted
    return Ranked(first if order[first] > least else None, order)


def answers(run_path: Path, store: Store, voyages: Sequence[str]) -> dict[str, Ranked]:
    """Of every method. Raises ShiplogError."""
    run = load_model.load(run_path)
    names = store.select(list(voyages))
    trained = [*run.config.split.training, *run.config.split.validation]
    if set(names) & set(trained):
        raise RunError(
            f"{run.name} was trained on {', '.join(sorted(set(names) & set(trained)))}.",
            hint="compare the methods on voyages that no fit has used.",
        )
    profile = store.profile(names)
    usual, recorded = (
        recording.read([frame.collect() for frame in store.tables(some)], some, profile)
        for some in (trained, names)
    )
    trial = trial_of(run, usual, recorded, ()).trial
    trial, point = as_it_stands.begin(trial, run.extension_numbers())
    fitted = run.base()[1].values
    return {
        "regression": regression(trial, fitted, usual),
        "glr": likelihood_ratio(trial, point),
        "linear": linear(trial, point),
    }


# --- regression of accelerations ------------------------------------------------------------------


def regression(trial: Trial, fitted: np.ndarray, usual: Record) -> Ranked:
    """Coefficients stay as they were fitted; noise is as large as it was on the nominal voyages."""
    ref = trial.reference
    columns, model = ref.columns, ref.model
    theta = np.concatenate((fitted, np.zeros(columns.linearised - columns.base)))
    before = segments.cut(usual, segments.begins(usual))
    rest = beyond(model, theta, before.y, of_bins(before.driven, before.y.shape[1]))
    sd = np.sqrt((rest[_used(before)] ** 2).mean(0))
    cut, moved, observed = measurement_correction.read(model, ref.setting, trial.record, trial.rows)
    bins = cut.y.shape[1]
    y, driven, moved = cut.y, of_bins(cut.driven, bins), of_bins(moved.dense(), bins)
    used = _used(cut)
    by = {}
    for cause in model.causes:
        if cause.label in trial.fixed:
            continue
        own = []
        for i in columns.indices[cause.label]:
            q, step = i - columns.base, float(measurement_correction.READ_STEP * columns.unit[i])
            low, high = (
                beyond(
                    model, _with(theta, i, d), y + d * observed[..., q], driven + d * moved[..., q]
                )
                for d in (-step, step)
            )
            own.append((low - high)[used] / (2.0 * step))  # what is left falls as it explains
        by[cause.label] = np.stack(own, -1)
    return reported(bic(beyond(model, theta, y, driven)[used], by, sd))


def _with(theta: np.ndarray, at: int, value: float) -> np.ndarray:
    changed = theta.copy()
    changed[at] += value
    return changed


def beyond(model, theta: np.ndarray, y: np.ndarray, driven: np.ndarray) -> np.ndarray:
    """[S, B - 2, 3] measured acceleration less the model's, of 2 s means y [S, B, 6] and of what
    drove the ship then [S, B, A + 3].

    A central difference of 2 s means is the acceleration under a weight that falls to zero 3 s
    away; the model's is averaged under the same, ¼ ½ ¼.
    """
    measured = (y[:, 2:, VELOCITY] - y[:, :-2, VELOCITY]) / (2.0 * BIN)
    of_model = np.asarray(_accelerations(model, theta, y, driven))
    return measured - (0.25 * of_model[:, 2:] + 0.5 * of_model[:, 1:-1] + 0.25 * of_model[:, :-2])


@traced
def _accelerations(model, theta, y, driven):
    return model.acceleration(theta, y, driven[..., :-2], driven[..., -2:])


def of_bins(nodes: np.ndarray, bins: int) -> np.ndarray:
    """Means over bins [S, B, ...] of values at the nodes [S, K, ...], by the trapezium."""
    pairs = 0.5 * (nodes[:, 1:] + nodes[:, :-1])
    return pairs.reshape(len(nodes), bins, -1, *nodes.shape[2:]).mean(2)


def _used(cut: Cut) -> np.ndarray:
    """[S, B - 2] bool: all three bins of a difference were measured."""
    seen = np.asarray(cut.used.all(-1))
    return seen[:, 2:] & seen[:, 1:-1] & seen[:, :-2]


def bic(rest: np.ndarray, columns: Mapping[str, np.ndarray], sd: np.ndarray) -> dict[str, float]:
    """½ (BIC₀ - BIC) of each cause, BIC = n log(RSS/n) + k log n (Schwarz 1978).

    rest [n, 3], columns of each cause [n, 3, k], sd [3] of what is left where all is usual
    """
    y = (rest / sd).ravel()
    found = {}
    for label, own in columns.items():
        x = (own / sd[:, None]).reshape(len(y), -1)
        size = np.linalg.norm(x, axis=0)
        x = x / np.where(size > 0.0, size, 1.0)
        left = y - x @ np.linalg.lstsq(x, y, rcond=None)[0]
        ratio = math.log(float(y @ y) / float(left @ left))
        found[label] = 0.5 * (len(y) * ratio - x.shape[1] * math.log(len(y)))
    return found


# --- likelihood ratios of rollouts, white noise ---------------------------------------------------


@dataclass(frozen=True)
class White:
    """What the nominal voyages say where nothing but white noise is unexplained: its size [6], and
    of the coefficients [P] information and pull, in units."""

    noise: np.ndarray
    information: np.ndarray
    pull: np.ndarray


def likelihood_ratio(trial: Trial, point: Point) -> Ranked:
    """Coefficients after the nominal voyages, all of which count (κ = 1); BIC's price for
    numbers."""
    ref = trial.reference
    assert ref.nominal is not None
    before = learnt(ref.nominal, ref.columns, ref.wide.start, ref.wide.noise)
    tried = {c.label: ref.columns.indices[c.label] for c in ref.model.causes}
    tried = {label: at for label, at in tried.items() if label not in trial.fixed}
    total = white_total(point.linear, before.noise, ref.wide.start, _units(ref.columns))
    found = ratios(total, before.information, before.pull, tried)
    count = int(point.linear.cut.used.sum())
    price = {label: 0.5 * len(at) * math.log(count) for label, at in tried.items()}
    share = (1.0 - SURE) / max(len(tried), 1)  # Bonferroni
    wanted = {n: 0.5 * float(chdtri(len(at), share)) - price[n] for n, at in tried.items()}
    return reported({label: 0.5 * found[label] - price[label] for label in tried}, wanted)


def learnt(linear: Linear, columns: Columns, start: np.ndarray, noise: np.ndarray) -> White:
    """Noise and coefficients of the nominal voyages together, by turns."""
    alone = _white(linear)
    base, unit = columns.base, _units(columns)
    numbers = np.zeros(len(unit))
    for _ in range(ROUNDS):
        total = white_total(linear, noise, start, unit)[: base + 1, : base + 1]
        known = np.diag(columns.prior_information[:base])
        numbers[:base] = np.linalg.solve(total[1:, 1:] + known, total[1:, 0]) * unit[:base]
        z, covariance = likelihood.starts_and_accelerations(alone, numbers, _quiet(noise, start))
        gap = linear.e - linear.j @ numbers - np.einsum("sbcz,sz->sbc", alone.z, z)
        spread = np.einsum("sbcy,syz,sbcz->sbc", alone.z, covariance, alone.z, optimize=True)
        used = linear.cut.used
        noise = np.sqrt(np.where(used, gap**2 + spread, 0.0).sum((0, 1)) / used.sum((0, 1)))
    total = white_total(linear, noise, start, unit)[: base + 1, : base + 1]
    return White(noise, total[1:, 1:] + np.diag(columns.prior_information[:base]), total[1:, 0])


def _units(columns: Columns) -> np.ndarray:
    """[C] of coefficients and causes: simpler methods know nothing of a discrepancy."""
    return columns.unit[: columns.linearised]


def white_total(
    linear: Linear, noise: np.ndarray, start: np.ndarray, unit: np.ndarray
) -> np.ndarray:
    """[1 + C, 1 + C] products of [e | J] in units, the starts eliminated, no nodes."""
    return part_products.whole(_white(linear), _quiet(noise, start), unit).G


def _white(linear: Linear) -> Linear:
    """Without the acceleration's nodes: what the model does not explain is noise."""
    return replace(linear, z=linear.z[..., :6])


def _quiet(noise: np.ndarray, start: np.ndarray) -> ProcessNoise:
    return ProcessNoise(noise, np.zeros(3), 1.0, start)


def ratios(
    total: np.ndarray, known: np.ndarray, pull: np.ndarray, tried: Mapping[str, np.ndarray]
) -> dict[str, float]:
    """2 log Λ of each cause: by how much its numbers, free, lower χ² together with coefficients [P]
    held by `known` and `pull`."""
    base = slice(1, 1 + len(pull))
    inverse = np.linalg.inv(total[base, base] + known)
    solution = inverse @ (total[base, 0] + pull)
    found = {}
    for label, at in tried.items():
        joined = total[base, 1 + at]
        own = total[np.ix_(1 + at, 1 + at)] - joined.T @ inverse @ joined
        towards = total[1 + at, 0] - joined.T @ solution
        # numbers of which the data say nothing stay where they are
        found[label] = float(towards @ np.linalg.pinv(own, rcond=1e-9, hermitian=True) @ towards)
    return found


# --- our evidence, linearised once ----------------------------------------------------------------


def linear(trial: Trial, point: Point) -> Ranked:
    causes = [c for c in trial.reference.model.causes if c.label not in trial.fixed]
    _, found = evidence.scan(trial, point, causes, trial.fixed)
    return reported({one.name: one.evidence for one in found}, SHOWS_NATS)


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m pipelines.experiments.hidden_effects.rivals",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("base", type=Path, help="a run trained on the nominal voyages")
    parser.add_argument("--store", type=Path, required=True)
    parser.add_argument("--voyages", nargs="+", default=["trial_*"], help="of the trial")
    parser.add_argument("--json", type=Path, required=True, help="the file for the answers")
    given = parser.parse_args(arguments)
    try:
        found = answers(given.base, Store(given.store), given.voyages)
    except ShiplogError as error:
        print(error, file=sys.stderr)
        return 1
    methods = {name: one.as_json() for name, one in found.items()}
    content = json.dumps({"contract": 1, "methods": methods}, indent=1)
    given.json.write_text(content + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
