"""The residual acceleration along the measured path, with the conditions at each node.

    z | e ~ N(V Zᵀ R⁻¹ (e - J d), V),  V = (Zᵀ R⁻¹ Z + P⁻¹)⁻¹,  z = (δξ, a)

The posterior of a linear Gaussian model (Rasmussen & Williams 2006, Sec. 2.1), segment by segment,
P the covariance of start and process noise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import polars as pl

from shiplog.diagnosis.linear import segment_nodes, segments
from shiplog.diagnosis.linear.linear_segments import Linear
from shiplog.diagnosis.noise.likelihood import ProcessNoise, starts_and_accelerations
from shiplog.voyages.rows.recording import Record

HALF_SEGMENT = 8  # nodes: half a segment
ACCELERATIONS = ("surge_acceleration", "sway_acceleration", "yaw_acceleration")


@dataclass(frozen=True)
class Unexplained:
    """a | e at J nodes of S segments.

    mean, sd  [S, 3, J]  surge, sway [m/s²] and yaw [rad/s²]: V Zᵀ R⁻¹ (e - J d), diag(V)^½
    rows      [S, J]     of the record
    time      [S, J]     s into the voyage
    voyage    [S]        counts in the record's names
    node_step                 s between nodes
    """

    mean: np.ndarray
    sd: np.ndarray
    rows: np.ndarray
    time: np.ndarray
    voyage: np.ndarray
    node_step: float


def covering(record: Record) -> np.ndarray:
    """Rows at which segments begin so that each stretch is covered twice and to its end.

    Residual accelerations at the ends of a segment are biased towards zero, and `segments.begins`
    leaves up to a segment unread at the end of a stretch. The evidence can spare these data; a
    search for events cannot.
    """
    size = segments.grid(record).rows
    begins = segments.begins(record)
    between = begins + HALF_SEGMENT * round(record.timescale.node_step / record.step)
    between = between[between + size <= record.lasts[begins]]
    ends = np.append(np.flatnonzero(record.starts)[1:], len(record)) - 1 - size
    lasts = ends[(ends >= 0) & (record.firsts[np.maximum(ends, 0)] == record.firsts[ends + size])]
    return np.unique(np.concatenate((begins, between, lasts)))


def posterior(
    linear: Linear, d: np.ndarray, process_noise: ProcessNoise, record: Record
) -> Unexplained:
    """a | e, d at the nodes: residual acceleration, for numbers d [C] of the columns, SI.

    record   the one that `linear.cut` was cut from
    """
    count, size = len(linear.e), linear.z.shape[-1]
    nodes = (size - 6) // 3
    z, covariance = starts_and_accelerations(linear, d, process_noise)
    mean = z[:, 6:]
    sd = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2)[:, 6:])
    rows = segment_nodes.rows_of_nodes(linear.cut.rows, segments.grid(record))
    return Unexplained(
        mean.reshape(count, 3, nodes),
        sd.reshape(count, 3, nodes),
        rows,
        record.time[rows],
        linear.cut.voyage,
        record.timescale.node_step,
    )


def unique_instants(found: Unexplained) -> np.ndarray:
    """[S, J] bool: each instant once, by the better known of nodes less than half a step apart.

    Two segments share the node where they meet, and the last of a stretch overlaps.
    """
    voyage = np.broadcast_to(found.voyage[:, None], found.rows.shape).ravel()
    rows, time = found.rows.ravel(), found.time.ravel()
    doubt = (found.sd / found.sd.min((0, 2), keepdims=True)).sum(1).ravel()
    order = np.lexsort((rows, voyage))
    keep = np.ones(rows.size, dtype=bool)
    last = order[0]
    for at in order[1:]:
        if voyage[at] == voyage[last] and time[at] - time[last] < 0.5 * found.node_step:
            worse = at if doubt[at] > doubt[last] else last
            keep[worse] = False
            last = last if worse == at else at
        else:
            last = at
    return keep.reshape(found.rows.shape)


def table(found: Unexplained, record: Record) -> pl.DataFrame:
    """One row a node: residual acceleration and conditions; SI, in order of voyage and time.

    voyage, time_s, ACCELERATIONS, the same with _sd, x0, y0, heading in (-π, π], surge, sway,
    yaw_rate, the actuators, wind_ahead, wind_starboard (apparent, where it comes from), share (of
    the campaign). Motion, actuators and wind are means over a node's step about it (`means_about`).
    """
    keep = unique_instants(found)
    rows = found.rows[keep]
    order = np.argsort(rows)
    rows = rows[order]
    columns: dict[str, np.ndarray | list[str]] = {
        "voyage": [record.names[i] for i in record.voyage[rows]],
        "time_s": record.time[rows],
    }
    for kind, values in (("", found.mean), ("_sd", found.sd)):
        for channel, name in enumerate(ACCELERATIONS):
            columns[name + kind] = values[:, channel][keep][order]
    x0, surge, y0, sway, heading, yaw_rate = means_about(record, record.state, rows).T
    columns |= {
        "x0": x0, "y0": y0, "heading": np.arctan2(np.sin(heading), np.cos(heading)),
        "surge": surge, "sway": sway, "yaw_rate": yaw_rate,
    }  # fmt: skip
    actuator, wind = (
        means_about(record, record.actuator, rows),
        means_about(record, record.wind, rows),
    )
    columns |= dict(zip(record.profile.actuator_names, actuator.T, strict=True))
    columns |= {"wind_ahead": wind[:, 0], "wind_starboard": wind[:, 1], "share": record.share[rows]}
    return pl.DataFrame(columns)


def means_about(record: Record, values: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """x̄ᵢ = Σ_{|k - i| ≤ h} xₖ / (2h + 1): means [m, c] of values [n, c] over the time between two
    nodes, about rows i [m]; over less of it at the ends of a stretch."""
    half = round(0.5 * record.timescale.node_step / record.step)
    low = np.maximum(rows - half, record.firsts[rows])
    high = np.minimum(rows + half, record.lasts[rows]) + 1
    centre = values.mean(0)  # a running sum of large numbers would lose small changes
    sums = np.concatenate((np.zeros((1, values.shape[1])), np.cumsum(values - centre, axis=0)))
    return centre + (sums[high] - sums[low]) / (high - low)[:, None]
