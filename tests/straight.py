"""Campaigns and trials whose segments are exactly linear in every number.

Sensitivities are drawn once, so that nothing is compiled, integrated or trained, and what the
diagnosis says of such a trial can be worked out densely.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np

from shiplog.diagnosis.hypotheses.unrecorded_thruster import SideForce
from shiplog.diagnosis.linear import linear_segments, segment_nodes, segments
from shiplog.diagnosis.linear.linear_segments import Linear, Path
from shiplog.diagnosis.linear.parameter_layout import Columns
from shiplog.diagnosis.noise import discrepancy, part_products
from shiplog.diagnosis.noise.discrepancy import Discrepancy
from shiplog.diagnosis.noise.likelihood import ProcessNoise
from shiplog.diagnosis.nominal import nominal_reference
from shiplog.diagnosis.nominal.nominal_campaign import Campaign, prior
from shiplog.diagnosis.nominal.nominal_reference import Reference
from shiplog.diagnosis.nominal.voyage_effects import VoyageEffects, reduced
from shiplog.diagnosis.trial.fitted import Fit, Point
from shiplog.diagnosis.trial.trial import Trial
from shiplog.models.causes import Cause, Parameter, Setting
from shiplog.ship_profile import file as profiles
from shiplog.voyages.rows.recording import Record
from shiplog.voyages.rows.timescale import NODE_STEP, SEGMENT_S

PROFILE = profiles.load("esso-vectwin")
NOISE = np.array([0.02, 0.01, 0.03, 0.015, 0.004, 0.002])
PROCESS_NOISE = ProcessNoise(NOISE, np.array([0.08, 0.05, 0.03]), 4.0, np.full(6, 1.7))
SETTING = Setting(PROFILE, {"speed": 0.5, "length": 3.0, "mass": 245.0}, np.zeros((1, 2)), 1.0)
COEFFICIENTS = 2  # of the base model
STEP = 0.5  # s between rows


@dataclass(frozen=True)
class One(Cause):
    """A cause of one number in steps of its realistic size; `unit` tells one of a name apart."""

    word: str = "one"
    unit: str = ""

    kind = "ship"
    story = "Something changed."
    equation = "x = {size:.2f}"
    parameters = (Parameter("size", "", 0.5, 0.1),)

    @property
    def name(self) -> str:  # type: ignore[override]
        return self.word

    @property
    def label(self) -> str:
        return f"{self.word}:{self.unit}" if self.unit else self.word


@dataclass(frozen=True)
class Two(One):
    """A cause of two numbers."""

    word: str = "two"
    parameters = (Parameter("along", "", 0.5, 0.1), Parameter("across", "", 2.0, 0.4))


CAUSES = (Two(), One("drag"), One("clock", "wind"), One("clock", "gnss"), One("load"))


def sailed(count: int, voyages: int = 2, seed: int = 0) -> Record:
    """A record of `count` segments of 30 s each, in `voyages` of equal length, at 2 Hz."""
    rng = np.random.default_rng(seed)
    rows = round(SEGMENT_S / STEP)
    each = count // voyages * rows + 1
    t = STEP * np.arange(each)
    state, orders = [], []
    for _ in range(voyages):
        phase = rng.uniform(0.0, 6.0, (8, 1))
        period = rng.uniform(40.0, 110.0, (8, 1))
        waves = np.sin(2.0 * np.pi * t / period + phase)
        size = np.array([[20.0], [0.4], [15.0], [0.1], [2.0], [0.05]])
        state.append((size * waves[:6] + np.array([[0.0], [0.4], [0.0], [0.0], [0.0], [0.0]])).T)
        orders.append(np.stack((0.4 * waves[6], 0.3 * waves[7], 8.0 + 4.0 * waves[5]), -1))
    length = each * voyages
    starts = np.zeros(length, dtype=bool)
    starts[::each] = True
    wind = np.stack((2.0 + rng.standard_normal(length) * 0.3, np.full(length, -1.0)), -1)
    return Record(
        profile=PROFILE, names=tuple(f"v{i}" for i in range(voyages)),
        voyage=np.repeat(np.arange(voyages), each), time=np.tile(t, voyages),
        share=(np.arange(length) + 0.5) / length, starts=starts,
        measured=np.ones(length, dtype=bool), state=np.concatenate(state),
        actuator=np.concatenate(orders), wind=wind, step=STEP,
    )  # fmt: skip


def columns_of(causes: tuple[Cause, ...]) -> Columns:
    sizes = [cause.sizes(SETTING) for cause in causes]
    return Columns(COEFFICIENTS, causes, np.concatenate((np.array([0.3, 2.0]), *sizes)))


def passed(
    record: Record, columns: Columns, numbers: np.ndarray | None = None, *, seed: int = 1,
    noise: float = 1.0, sensitivity: float = 1.0, accelerations: np.ndarray | None = None,
) -> Linear:  # fmt: skip
    """One pass of a record, drawn: e = Z z + J d + noise with `numbers` d [C] in SI.

    noise    times the standard deviations of PROCESS_NOISE, of instrument and process noise
    sensitivity  what one unit of a number moves an observation by, in its standard deviations
    accelerations   [S, 3J] in addition to the process noise
    """
    rng = np.random.default_rng(seed)
    g = segments.grid(record)
    cut = segments.cut(record, segments.begins(record))
    nodes, count = g.nodes, columns.linearised
    size = 6 + 3 * nodes
    z = rng.standard_normal((*cut.y.shape, size)) * NOISE[:, None] * 3.0
    j = rng.standard_normal((*cut.y.shape, count)) * NOISE[:, None] * sensitivity
    j = j / columns.unit[:count]
    # each cause in columns of its own stream: another order of the causes is the same data
    for cause in columns.causes:
        own = np.random.default_rng([seed, *cause.label.encode()])
        at = columns.indices[cause.label]
        drawn = own.standard_normal((*cut.y.shape, len(at))) * NOISE[:, None] * sensitivity
        j[..., at] = drawn / columns.unit[at]
    d = np.zeros(count) if numbers is None else numbers
    kernel = np.linalg.cholesky(PROCESS_NOISE.kernel(nodes))
    start = PROCESS_NOISE.start * rng.standard_normal((len(cut), 6))
    acceleration = noise * rng.standard_normal((len(cut), 3 * nodes)) @ kernel.T
    if accelerations is not None:
        acceleration = acceleration + accelerations
    moved = np.einsum("sbcz,sz->sbc", z, np.concatenate((start, acceleration), 1))
    e = moved + j @ d + noise * NOISE * rng.standard_normal(cut.y.shape)
    path = Path(np.zeros((len(cut), 6)), np.zeros((len(cut), 3, nodes)))
    return Linear(cut, path, e, z, j)


def campaign(
    nominal: Record, given: Linear, columns: Columns, *, parts: int = 4, share: float = 1.0,
    deviation: float = 0.1, size: float = 0.3, names: tuple[str, ...] = ("motion",),
    noise: float = 0.1,
) -> Campaign:  # fmt: skip
    """What `nominal_campaign.learn` makes of a pass, with deviations and sizes as given."""
    g = segments.grid(nominal)
    nodes = segment_nodes.conditions_at_nodes(given.cut, g)
    first = columns.linearised
    size_of = PROCESS_NOISE.acceleration
    of_own = Discrepancy((), size_of)
    if names:
        of_own = discrepancy.build(PROFILE, size_of, first, names, nodes)
    columns = columns.with_misfit(of_own.count)
    count = len(columns.unit)
    unseen = discrepancy.build(
        PROFILE, PROCESS_NOISE.acceleration, count, discrepancy.OMITTED, nodes
    )
    accelerations = np.concatenate([of.accelerations(given.cut, g) for of in (of_own, unseen)], -1)
    rows = np.array_split(np.arange(len(given.cut)), parts)
    passes = part_products.passes(
        given, PROCESS_NOISE, rows, np.append(columns.unit, np.ones(unseen.count)),
        accelerations=accelerations,
    )  # fmt: skip
    each = [one.gram(PROCESS_NOISE.inverse_kernels(g.nodes)).G for one in passes]
    spread = np.full(count, deviation)
    sizes = columns.prior_information**-0.5
    sizes[first:] = size
    anchor = np.zeros(count)
    kept = [reduced(one[: 1 + count, : 1 + count], spread)[0] for one in each]
    information, pull = prior(kept, sizes**-2.0, anchor, spread, share)
    model = SimpleNamespace(causes=columns.causes, base=None, bends=False)
    made = Reference(
        model, SETTING, np.zeros(COEFFICIENTS), columns, PROCESS_NOISE,  # type: ignore[arg-type]
        linear_segments.Wide(NOISE, PROCESS_NOISE.start, PROCESS_NOISE.acceleration),
        information, pull, anchor, given, nominal_reference.freedom(parts),
        misfit=of_own if of_own.families else None,  # type: ignore[arg-type]
        counts=share,
    )  # fmt: skip
    return Campaign(
        made, VoyageEffects(spread, sizes), of_own, unseen, tuple(each), np.arange(parts), 0.0,
        noise, tuple(rows), np.ones(len(given.cut)),
    )  # fmt: skip


@dataclass(frozen=True)
class Straight(Trial):
    """A trial whose pass is the same wherever its causes stand, less what their numbers do."""

    given: Linear | None = None

    def linearise(self, numbers, near=None, noise_factor=None, remainder=None) -> Point:
        return self.linearise_about(numbers, replace(self.own.path))

    @property
    def own(self) -> Linear:
        """The pass of its segments, which may be some of those that are given."""
        assert self.given is not None
        kept = np.isin(self.given.cut.rows, self.rows)
        return self.given if kept.all() else self.given.pick(kept)

    def linearise_about(self, numbers, path) -> Point:
        given, columns = self.own, self.reference.columns
        d = np.concatenate((np.zeros(columns.base), columns.numbers(dict(numbers))))
        linear = replace(given, e=given.e - given.j @ d, path=path)
        return self._refuse_divergent(Point(dict(numbers), path, linear))


def trial(made: Campaign, record: Record, given: Linear, fixed: tuple[str, ...] = ()) -> Straight:
    """One of equal weights that was linearised where nothing has changed."""
    found = Straight.build(made, record, fixed, given=given)
    return replace(found, first=found.linearise({}))


def no_hull(_: Fit) -> SideForce:
    """There is no hull that an intermittent force could act on."""
    return SideForce(0.0, -1.0, 0.0, 1.0, np.zeros(3))


def dense(given: Linear, process_noise: ProcessNoise, rows: np.ndarray | None = None):
    """Of each segment e [N], J [N, C], Z [N, 3J] by the nodes and its covariance C [N, N]: start
    and acceleration in it, explicitly."""
    nodes = (given.z.shape[-1] - 6) // 3
    at = NODE_STEP * np.arange(nodes)
    stays = np.exp(-np.abs(at[:, None] - at) / process_noise.time)
    kernel = np.zeros((6 + 3 * nodes,) * 2)
    kernel[:6, :6] = np.diag(process_noise.start**2)
    kernel[6:, 6:] = np.kron(np.diag(process_noise.acceleration**2), stays)
    for s in range(len(given.e)) if rows is None else rows:
        z = given.z[s].reshape(-1, given.z.shape[-1])
        r = np.diag(np.tile(process_noise.noise**2, given.e.shape[1]))
        yield (
            given.e[s].ravel(),
            given.j[s].reshape(len(z), -1),
            z[:, 6:],
            r + z @ kernel @ z.T,
        )
