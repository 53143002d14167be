"""A trial on a straight course, and the same hypotheses as dense Gaussians."""

import numpy as np
import straight
from scipy.stats import multivariate_normal
from straight import PROCESS_NOISE

from shiplog.diagnosis.hypotheses import evidence
from shiplog.diagnosis.noise import remainder
from shiplog.diagnosis.noise.remainder import NOMINAL, Remainder

SHARE = 0.5  # of itself that the trial counts
DRAG = 1.5  # three realistic sizes, in the trial


def gaussian(trial, point, noise, included=(), families=(), size=1.0, parts=None):
    """[N, C] columns, prior mean and covariance of them, e and its covariance, all dense: nominal
    numbers, then each part's own, then the included causes', then weights of a family's change."""
    ref = trial.reference
    columns, count = ref.columns, len(ref.pull)
    nominal_covariance = np.linalg.inv(ref.information)
    mean = nominal_covariance @ ref.pull
    parts = trial.parts if parts is None else parts
    e, nominal, extra, change, blocks = [], [], [], [], []
    cut, linear = point.linear.cut, point.linear
    observed = ref.misfit.accelerations(cut, trial.grid)
    unseen = trial.omitted.accelerations(cut, trial.grid)
    for s, (error, j, z, c) in enumerate(straight.dense(linear, PROCESS_NOISE.times(noise))):
        unit = columns.unit[: j.shape[1]]
        both = np.concatenate((j * unit, z @ observed[s]), 1)
        every = np.concatenate((both, z @ unseen[s]), 1)
        e.append(error)
        nominal.append(both)
        extra.append(both[:, [i for n in included for i in columns.indices[n]]])
        change.append(every[:, [i for n in families for i in trial.families[n]]])
        blocks.append(c)
    whole_e, j = np.concatenate(e), np.concatenate(nominal)
    rows = len(e[0])
    covariance = np.zeros((len(whole_e),) * 2)
    for s, c in enumerate(blocks):
        covariance[s * rows : (s + 1) * rows, s * rows : (s + 1) * rows] = c
    deviation = trial.campaign.effects.deviation
    for part in parts:
        inside = np.concatenate([np.arange(s * rows, (s + 1) * rows) for s in part])
        covariance[np.ix_(inside, inside)] += (j[inside] * deviation**2) @ j[inside].T
    x, d = np.concatenate(extra), np.concatenate(change)
    stood = [-np.asarray(point.numbers.get(n, np.zeros(len(columns.indices[n]))))
             / columns.unit[columns.indices[n]] for n in included]  # fmt: skip
    before = np.concatenate([*stood, np.zeros(0)])
    return (
        whole_e, j, x, d, covariance, mean, nominal_covariance, before, size, count,
    )  # fmt: skip


def nats(trial, point, noise, included=(), families=(), size=1.0) -> float:
    """log of a power of the likelihood, times the prior, integrated: a Gaussian whose covariance
    is 1/share as large. Constants that no hypothesis changes are left out."""
    e, j, x, d, c, mean, nominal, before, size, _ = gaussian(
        trial, point, noise, included, families, size
    )
    share = trial.reference.counts
    whole = c / share + j @ nominal @ j.T + x @ x.T + size**2 * d @ d.T
    return float(multivariate_normal(j @ mean + x @ before, whole).logpdf(e))


def level(trial, point, noise, included=(), kind=NOMINAL, size=1.0):
    return evidence.level(trial, point, noise, included, Remainder(kind, size))


def of_noise(trial, noise, remaining=Remainder()):  # noqa: B008
    return remainder.noise_prior(noise, trial.nominal_spread, remaining)
