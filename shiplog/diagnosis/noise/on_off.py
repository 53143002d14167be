"""When a force that is either on or off was on.

A hidden Markov model of two states sₖ (Rabiner 1989): the force at a node is Gaussian about zero,
large or small. The most probable course of the states and the sizes are estimated in turn.

    |Fₖ| given sₖ:  N(0, v_s + σₖ²),  v_on = mean of F² where it is on, v_off where it is off
    p(s) = p(s₁) Π p(sₖ | sₖ₋₁);  max over s of  Σₖ log N(Fₖ) + log p(s)       Viterbi (1967)

Before any data, each probability of a change is uniform, and with the numbers n of each kind of
transition   p(s) = ½ B(1 + n_off→on, 1 + n_off→off) B(1 + n_on→off, 1 + n_on→on).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import betaln

STRONGEST = 0.95  # quantile of the force's size, since a single node may be off
ON = 0.5  # share of the strongest, above which it is on, before a course is known
ROUNDS = 10  # of estimating course and sizes in turn, at most
LEAST_SHARE = 1e-3  # of the large force, that the small one is at least

Intervals = tuple[tuple[int, int], ...]


@dataclass(frozen=True)
class Course:
    """When a force is on.

    on     first and last row of the record of each run in which it is, in order
    prior  log probability of such a course before any data, nats
    """

    on: Intervals
    prior: float


def course(force: np.ndarray, deviation: np.ndarray, rows: np.ndarray) -> Course | None:
    """The most probable course; None where the force is always on, or always off.

    force, deviation  F, σ [S, J], estimate at the nodes and its standard deviation, N
    rows              [S, J] of the record at the nodes, in order
    """
    size, variance = np.abs(force.ravel()), deviation.ravel() ** 2
    on = size > ON * np.quantile(size, STRONGEST)
    for _ in range(ROUNDS):
        if on.all() or not on.any():
            return None
        large = float(np.mean(size[on] ** 2))
        small = max(float(np.mean(size[~on] ** 2)), LEAST_SHARE**2 * large)
        each = np.stack([_log_density(size, v + variance) for v in (small, large)], -1)
        before, on = on, _most_probable(each, _log_transitions(on))
        if (on == before).all():
            break
    if on.all() or not on.any():
        return None
    return Course(_intervals(on.reshape(rows.shape), rows), _log_prior(on))


def runs(on: Intervals, rows: np.ndarray) -> np.ndarray:
    """onᵢⱼ [S, J, J]: 1 where the force is on at both nodes i and j of a segment, in one run, and 0
    elsewhere; `rows` [S, J] of the record at the nodes."""
    first, last = np.array(on).T
    of = np.searchsorted(first, rows, side="right") - 1
    of = np.where((of >= 0) & (rows <= last[of]), of, -1)
    return ((of[:, :, None] == of[:, None, :]) & (of[:, :, None] >= 0)).astype(float)


def _log_density(size: np.ndarray, variance: np.ndarray) -> np.ndarray:
    """log N(F; 0, v) = -½ (F²/v + log v), up to a constant."""
    return -0.5 * (size**2 / variance + np.log(variance))


def _counts(on: np.ndarray) -> np.ndarray:
    """[2, 2] how often each state (off, on) is followed by each."""
    pairs = 2 * on[:-1].astype(int) + on[1:]
    return np.bincount(pairs, minlength=4).reshape(2, 2).astype(float)


def _log_transitions(on: np.ndarray) -> np.ndarray:
    """log((n + 1)/Σ(n + 1)) [2, 2] from each state to each: their mean after a uniform prior
    (Laplace)."""
    counts = _counts(on) + 1.0
    return np.log(counts / counts.sum(1, keepdims=True))


def _log_prior(on: np.ndarray) -> float:
    """log p(s) = log B(1 + n_off→on, 1 + n_off→off) + log B(1 + n_on→off, 1 + n_on→on) - log 2:
    each probability of a change uniform from 0 to 1."""
    (stays_off, goes_on), (goes_off, stays_on) = _counts(on)
    whole = betaln(1.0 + goes_on, 1.0 + stays_off) + betaln(1.0 + goes_off, 1.0 + stays_on)
    return float(whole) - math.log(2.0)  # either may be the first


def _most_probable(each: np.ndarray, transitions: np.ndarray) -> np.ndarray:
    """argmax_s Σₖ log N(Fₖ | sₖ) + log p(sₖ | sₖ₋₁) [n] bool (Viterbi 1967), of the log densities
    [n, 2] of each state."""
    reached = each[0]
    came_from = np.zeros(each.shape, dtype=int)
    for at in range(1, len(each)):
        ways = reached[:, None] + transitions
        came_from[at] = ways.argmax(0)
        reached = ways.max(0) + each[at]
    states = np.empty(len(each), dtype=int)
    states[-1] = reached.argmax()
    for at in range(len(each) - 1, 0, -1):
        states[at - 1] = came_from[at, states[at]]
    return states.astype(bool)


def _intervals(on: np.ndarray, rows: np.ndarray) -> Intervals:
    """Rows of each run's first and last node; runs of two segments that share a node are one."""
    found: list[tuple[int, int]] = []
    for states, at in zip(on, rows, strict=True):
        edges = np.flatnonzero(np.diff(np.concatenate(([False], states, [False])).astype(int)))
        for begin, end in edges.reshape(-1, 2):
            first, last = int(at[begin]), int(at[end - 1])
            if found and first <= found[-1][1]:
                found[-1] = (found[-1][0], max(last, found[-1][1]))
            else:
                found.append((first, last))
    return tuple(found)
