"""Parts of a campaign, the prior that they make, and how much of itself a trial counts."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import straight
from straight import CAUSES, PROCESS_NOISE, SETTING

from shiplog.diagnosis.linear import segments
from shiplog.diagnosis.linear.parameter_layout import Columns
from shiplog.diagnosis.noise import campaign_parts, discrepancy, part_products
from shiplog.diagnosis.noise.campaign_parts import FEWEST_PARTS, parts_of
from shiplog.diagnosis.noise.discrepancy import Discrepancy
from shiplog.diagnosis.nominal import (
    campaign_characteristics,
    nominal_campaign,
    nominal_fit,
    nominal_reference,
    voyage_effects,
)
from shiplog.diagnosis.nominal.campaign_characteristics import groups_of
from shiplog.diagnosis.nominal.campaign_prior import INFORMATION_SHARES as SHARES
from shiplog.diagnosis.nominal.campaign_prior import prior
from shiplog.diagnosis.nominal.nominal_fit import Converged
from shiplog.live import left_out
from shiplog.models.causes import CATALOGUE
from shiplog.models.starting_values import Start


def cuts(seed: int) -> np.ndarray:
    """Voyages of segments, some of one only."""
    rng = np.random.default_rng(seed)
    each = rng.integers(1, [3, 12, 60, 150][seed % 4], size=rng.integers(1, 7))
    return np.repeat(rng.permutation(len(each)), each)


@pytest.mark.parametrize("seed", range(24))
def test_parts_are_whole_stretches_of_one_voyage(seed):
    voyage = cuts(seed)
    parts = parts_of(voyage)
    assert np.concatenate(parts).tolist() == list(range(len(voyage)))  # all of them, in order
    for rows in parts:
        assert len(rows)
        assert (np.diff(rows) == 1).all()
        assert len(set(voyage[rows])) == 1
    if len(voyage) >= 2 * FEWEST_PARTS:
        assert len(parts) >= FEWEST_PARTS


@pytest.mark.parametrize(
    ("voyages", "sizes"),
    (
        ((100,), (20, 20, 20, 20, 20)),
        ((50, 50), (25, 25, 25, 25)),  # 50 / 20 is 2.5, which rounds to two
        ((30,), (5, 5, 5, 5, 5, 5)),  # of ten each there were but three
        ((8,), (2, 2, 2, 2)),
        ((1, 1, 1, 1), (1, 1, 1, 1)),
        ((3,), (3,)),  # too few to be cut
    ),
)
def test_parts_by_hand(voyages, sizes):
    found = tuple(map(len, parts_of(np.repeat(np.arange(len(voyages)), voyages))))
    assert found == sizes
    assert sum(found) == sum(voyages)


def test_products_of_parts_are_those_of_the_whole():
    """Sums of segments, weighted, in units of the numbers."""
    columns = straight.columns_of(CAUSES[:2])
    record = straight.sailed(6)
    given = straight.passed(record, columns)
    weight = np.linspace(0.2, 1.0, 6)
    unit = columns.unit
    rows = [np.arange(2), np.arange(2, 6)]
    prior = PROCESS_NOISE.times(1.3).inverse_kernels(segments.grid(record).nodes)
    passes = part_products.passes(given, PROCESS_NOISE, rows, unit, weight)
    found = [one.gram(prior).G for one in passes]
    wanted = np.zeros((1 + len(unit),) * 2)
    for s, (e, j, _, c) in enumerate(straight.dense(given, PROCESS_NOISE.times(1.3))):
        both = np.concatenate((e[:, None], j * unit), 1)
        wanted += weight[s] * both.T @ np.linalg.solve(c, both)
    assert sum(found) == pytest.approx(wanted, rel=1e-6)
    every = part_products.whole(given, PROCESS_NOISE.times(1.3), unit, weight)
    assert np.allclose(every.G, wanted, rtol=1e-6)


def test_weights_of_segments_by_hand():
    """Six medians off is the edge; what is lost stays so and is not in the median."""
    square = np.array([1.0, 2.0, 3.0, 36.0, 1e9])
    kept = np.array([True, True, True, True, False])
    found = campaign_parts.robust_weights(square, kept)  # the median of four is 2.5
    assert found == pytest.approx([1.0, 1.0, 1.0, 15.0 / 36.0, 0.0])
    assert campaign_parts.robust_weights(square, np.zeros(5, dtype=bool)).tolist() == [0.0] * 5


# --- a campaign identified from a pass that is exactly linear


@pytest.fixture(scope="module")
def model():
    class Base:
        names = ("hull.X_vv", "rudder.t_R")

    class Model:
        base = Base()
        causes = CAUSES[:2]

    return Model()


START = Start(np.zeros(2), np.array([0.3, 2.0]), np.full(2, -9.0), np.full(2, 9.0))


@pytest.fixture(scope="module")
def learned(model):
    """Characteristics and campaign of 24 segments in two voyages, with `drag` in all of them."""
    columns = nominal_fit.columns_of(model, SETTING, START)
    record = straight.sailed(24)
    numbers = np.zeros(len(columns.unit))
    numbers[columns.indices["drag"]] = 0.5
    given = straight.passed(record, columns, numbers, sensitivity=0.3)
    at = Converged(np.zeros(2), given.path, PROCESS_NOISE)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(campaign_characteristics, "read", lambda *_: (given.cut, None, None))
        patch.setattr(campaign_characteristics.linearisation, "linear", lambda *_: given)
        patch.setattr(
            campaign_characteristics.linearisation, "fit_path", lambda *_, **__: given.path
        )
        found = campaign_characteristics.characteristics(model, SETTING, START, record, at)
        made = nominal_campaign.learn(model, SETTING, START, record, at, found)
    return found, made


def test_a_campaign_knows_what_is_nominal_of_a_cause(learned):
    """The cause that all voyages have is expected in a trial, to within its spread."""
    _, made = learned
    at = made.reference.columns.indices["drag"][0]
    spread = np.sqrt(np.linalg.inv(made.reference.information)[at, at])
    assert 0.01 < spread < 0.5
    assert made.reference.mean[at] == pytest.approx(1.0, abs=4.0 * spread)  # in units of 0.5


def test_degrees_of_freedom_are_those_of_voyages_and_parts_of_one_share_its_deviation(
    learned, model
):
    """Two voyages leave two, the least, however many parts they have. One voyage alone has a
    deviation of its own, which its parts cannot average out: θ is no better known than that."""
    found, made = learned
    assert made.reference.freedom == nominal_reference.freedom(2) == 2.0
    assert nominal_reference.freedom(6) == 5.0
    record = straight.sailed(24, voyages=1)
    columns = nominal_fit.columns_of(model, SETTING, START)
    given = straight.passed(record, columns, np.zeros(len(columns.unit)), sensitivity=0.3)
    at = Converged(np.zeros(2), given.path, PROCESS_NOISE)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(campaign_characteristics, "read", lambda *_: (given.cut, None, None))
        patch.setattr(campaign_characteristics.linearisation, "linear", lambda *_: given)
        one = nominal_campaign.learn(
            model, SETTING, START, record, at, replace(found, path=given.path, apart=0.8)
        )
    least = 0.8 * one.effects.deviation
    spread = np.sqrt(np.diagonal(np.linalg.inv(one.reference.information)))
    assert (spread >= least).all() and (least > 0.0).any()
    assert one.reference.freedom == float(len(one.parts) - 1)


def test_characteristics_say_every_group_once(learned):
    found, made = learned
    assert set(found.deviation) == {
        "hull coefficients", "rudder coefficients", "two", "drag",
        "motion discrepancy", "controls discrepancy", "wind discrepancy",
    }  # fmt: skip
    assert set(found.size) == set(discrepancy.MODELLED)
    assert all(0.0 < value < 1.0 for value in found.deviation.values())
    # what a trial is given is by these names, column by column
    columns = made.reference.columns
    for label in ("two", "drag"):
        assert made.effects.deviation[columns.indices[label]] == pytest.approx(
            found.deviation[label]
        )
    for family in made.discrepancy.families:
        assert made.effects.size[family.columns] == pytest.approx(found.size[family.name])
    assert made.reference.counts == found.share
    # of a model without any misfit little of it is estimated: sizes in units of the process noise
    assert max(found.size.values()) < 0.5
    # parts drawn with one process noise differ by what seven steps of a grid can tell
    assert 0.0 <= found.noise < 0.3


def test_a_path_follows_the_discrepancy_with_all_other_numbers_where_they_are(learned):
    """The weights that fit best while coefficients and causes stay, by ridge regression on rows;
    a trial's path is expected to follow them."""
    rng = np.random.default_rng(3)
    columns = straight.columns_of(CAUSES[:2]).with_misfit(4)
    count = len(columns.unit)
    rows = rng.standard_normal((60, 1 + count))
    known = rng.uniform(0.5, 2.0, count)
    found = nominal_fit.discrepancy_here(rows.T @ rows, known, columns)
    e, w = rows[:, 0], rows[:, -4:]
    padded = np.concatenate((w, np.diag(np.sqrt(known[-4:]))))
    wanted, *_ = np.linalg.lstsq(padded, np.concatenate((e, np.zeros(4))), rcond=None)
    assert found == pytest.approx(wanted)
    _, made = learned
    ref, cut = made.reference, made.reference.nominal.cut
    assert ref.expected.shape == (made.discrepancy.count,)
    g = segments.grid(straight.sailed(24))
    assert ref.expected_acceleration(cut, g) == pytest.approx(
        made.discrepancy.accelerations(cut, g) @ ref.expected
    )


def test_columns_follow_one_another(learned):
    """Coefficients, causes, then what a model sees; the families that none sees come after."""
    _, made = learned
    columns = made.reference.columns
    at = columns.linearised
    for family in (*made.discrepancy.families, *made.omitted.families):
        assert family.columns.tolist() == list(range(at, at + len(family.columns)))
        at += len(family.columns)
    assert len(columns.unit) == columns.linearised + made.discrepancy.count
    assert all(len(one) == 1 + len(columns.unit) + made.omitted.count for one in made.each)
    assert len(made.each) == len(made.parts) == len(parts_of(made.reference.nominal.cut.voyage))


def test_a_prior_without_a_part_has_less_and_all_of_them_the_same(learned):
    _, made = learned
    ref = made.reference
    count = 1 + len(ref.pull)
    kept = [one[:count, :count] for one in made.voyages]
    none = np.zeros(count - 1)
    information, pull = prior(kept, made.effects.size**-2.0, ref.anchor, none, ref.counts)
    assert information == pytest.approx(ref.information, rel=1e-6, abs=1e-6)
    assert pull == pytest.approx(ref.pull, rel=1e-6, abs=1e-6)
    for i in range(len(made.voyages)):
        less, _ = made.prior_without(i)
        gone = np.linalg.eigvalsh(ref.information - less)
        assert gone.min() > -1e-6 * gone.max()
        assert gone.max() > 0.0
    nobody, _ = made.prior_without(-1)
    assert nobody == pytest.approx(ref.information)


def test_a_voyage_that_is_left_out_has_no_say(learned):
    """Neither in coefficients nor in how far parts and voyages differ: with other products of that
    voyage nothing changes, with other products of those that stay it does."""
    _, made = learned
    voyages = np.unique(made.voyage)
    assert len(voyages) == 2

    def with_other(number):
        """Parts of a voyage whose errors are three times as large, and coupled otherwise."""
        scale = np.append(3.0, np.linspace(0.5, 2.0, len(made.each[0]) - 1))
        each = [one * np.outer(scale, scale) if of == number else one
                for one, of in zip(made.each, made.voyage, strict=True)]  # fmt: skip
        return left_out.without(replace(made, each=tuple(each)), voyages[:1], SHARES)

    plain = left_out.without(made, voyages[:1], SHARES)
    assert set(plain.voyage) == set(voyages[1:]) and len(plain.each) < len(made.each)
    same, other = with_other(voyages[0]), with_other(voyages[1])
    assert (same.effects.deviation == plain.effects.deviation).all()
    assert (same.apart, same.reference.counts) == (plain.apart, plain.reference.counts)
    for one, two in zip(same.prior_without(-1, 0.5), plain.prior_without(-1, 0.5), strict=True):
        assert (one == two).all()
    assert not np.allclose(other.prior_without(-1)[1], plain.prior_without(-1)[1])
    folds = list(left_out.folds(made, made.voyage))
    assert [out.tolist() for out, _ in folds] == [[0], [1]]


def test_what_is_left_of_a_campaign_has_nothing_that_its_parts_differ_by(learned):
    """With the numbers of every part free, its products with what is left are zero there; where
    parts do not differ, what the campaign says in common is gone and no more."""
    _, made = learned
    ref, record = made.reference, straight.sailed(24)
    count = len(ref.columns.unit)
    accelerations = ref.misfit.accelerations(ref.nominal.cut, segments.grid(record))

    def pulls(left):
        prior = ref.process_noise.inverse_kernels(segments.grid(record).nodes)
        each = part_products.passes(
            left, ref.process_noise, made.rows, ref.columns.unit, made.weight, accelerations
        )
        return np.stack([one.gram(prior).G[1:, 0] for one in each])

    free = replace(made, effects=replace(made.effects, deviation=np.full(count, 1e4)))
    before = np.abs(pulls(ref.nominal)).max(0)
    assert (np.abs(pulls(free.residual(record))) < 1e-3 * before.max()).all()
    alike = replace(made, effects=replace(made.effects, deviation=np.zeros(count)))
    numbers = np.tile(ref.mean * ref.columns.unit, (len(ref.nominal.e), 1))
    wanted = ref.nominal.less_numbers(numbers, accelerations)
    assert alike.residual(record).e == pytest.approx(wanted.e)
    assert replace(made, rows=(), each=()).residual(record) is None


def test_a_name_that_the_campaign_did_not_know_may_differ_least(learned, model, monkeypatch):
    """A cause that only the trial can have, such as a second place's: no deviation was learned."""
    found, _ = learned
    columns = nominal_fit.columns_of(model, SETTING, START)
    record = straight.sailed(24)
    given = straight.passed(record, columns, sensitivity=0.3)
    monkeypatch.setattr(campaign_characteristics, "read", lambda *_: (given.cut, None, None))
    monkeypatch.setattr(campaign_characteristics.linearisation, "linear", lambda *_: given)
    less = replace(found, deviation={n: v for n, v in found.deviation.items() if n != "drag"})
    at = Converged(np.zeros(2), given.path, PROCESS_NOISE)
    made = nominal_campaign.learn(model, SETTING, START, record, at, less)
    own = made.effects.deviation[columns.indices["drag"]]
    assert own == pytest.approx([voyage_effects.UNSEEN_DEVIATION])


def test_coefficients_are_at_least_as_free_as_the_causes_that_scale_them(model):
    """`scaled` may grow one coefficient by 1.5 at its realistic size of 0.5; the other stays."""

    class Scaled(straight.One):
        def coefficients(self, c, p, state, share, at):
            return c | {"hull.X_vv": c["hull.X_vv"] * (1.0 + p[0])}

        @property
        def absorbed(self):
            return True

    class Model:
        base = model.base
        causes = (Scaled("scaled"),)

    start = replace(START, values=np.array([3.0, 0.8]))
    assert nominal_campaign.widen(Model(), SETTING, start).spread == pytest.approx([1.5, 2.0])
    # of a cause that no fit absorbs nothing follows
    assert nominal_campaign.widen(model, SETTING, start).spread == pytest.approx([0.3, 2.0])


def test_a_clock_that_two_channels_share_has_a_variance_of_its_own():
    by = {cause.label: cause for cause in CATALOGUE}
    shared = [by[f"clock_offset:{channel}"] for channel in ("position", "velocity", "gnss")]
    causes = (*shared, by["rudder_delay"])
    model = SimpleNamespace(base=SimpleNamespace(names=()), causes=causes)
    columns = Columns(0, causes, np.ones(4))
    found = groups_of(model, columns, Discrepancy((), np.ones(3)))
    assert {name: rows.tolist() for name, rows in found.items()} == {
        cause.label: [at] for at, cause in enumerate(shared)
    }


def test_the_wind_of_the_ship_and_that_of_the_discrepancy_are_two_groups():
    """Coefficients, numbers of a cause and weights of a family, whatever they are called."""
    wind = SimpleNamespace(label="hull", count=1, nominal=True, varies=True)
    model = SimpleNamespace(
        base=SimpleNamespace(names=("wind.x0", "hull.x", "wind.y")), causes=(wind,)
    )
    columns = Columns(3, (wind,), np.ones(6))
    family = SimpleNamespace(name="wind", columns=np.array([4, 5]))
    found = groups_of(model, columns, SimpleNamespace(families=(family,)))
    assert sorted(rows.tolist() for rows in found.values()) == [[0, 2], [1], [3], [4, 5]]
