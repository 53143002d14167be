"""What causes explain of nominal voyages: of one voyage that has a cause, and of none."""

from dataclasses import replace

import numpy as np
import pytest
import straight
from straight import CAUSES

from shiplog.diagnosis.noise.campaign_parts import marginal
from shiplog.diagnosis.noise.remainder import CHANGE_SIZES
from shiplog.diagnosis.nominal.placebo import placebos

SHARE = 0.5


class Held(straight.One):
    """A cause of which the nominal campaign has no number of its own."""

    nominal = False


def campaign(changed: float, part: int = 2, sensitivity: float = 0.6):
    """Four parts of three segments; one of them has `drag`, in its realistic size of 0.5."""
    columns = straight.columns_of(CAUSES)
    record = straight.sailed(12)
    given = straight.passed(record, columns, sensitivity=sensitivity)
    numbers = np.zeros(columns.linearised)
    numbers[columns.indices["drag"]] = 0.5 * changed
    inside = np.arange(3 * part, 3 * part + 3)
    given.e[inside] += given.j[inside] @ numbers
    return straight.campaign(record, given, columns, share=SHARE, deviation=0.02, size=0.1)


def test_a_cause_that_one_voyage_has_is_a_placebo_and_no_other_is():
    """Four realistic sizes of it in a quarter of the campaign, of numbers known to a tenth."""
    found = placebos(campaign(4.0))
    assert found["drag"] > 20.0
    assert max(value for name, value in found.items() if name != "drag") < 3.0
    assert min(found.values()) >= 0.0


def test_voyages_without_any_have_none():
    found = placebos(campaign(0.0))
    assert set(found) == {c.label for c in CAUSES} | {"motion", "position", "heading", "time"}
    assert max(found.values()) < 3.0
    assert max(found[c.label] for c in CAUSES) < 1.0


def test_it_is_the_same_in_whichever_part_it_is():
    values = [placebos(campaign(4.0, part))["drag"] for part in range(4)]
    assert min(values) > 20.0
    assert max(values) < 3.0 * min(values)


@pytest.mark.parametrize(
    ("name", "sizes"), (("drag", (1.0,)), ("motion", CHANGE_SIZES), ("time", CHANGE_SIZES))
)
def test_a_placebo_is_the_difference_of_two_evidences(name, sizes):
    """Of each part against the prior of the others: with the cause's own number in addition to
    what is nominal of it, and without; the most of all parts, and of all sizes."""
    made = campaign(1.5)
    columns = made.reference.columns
    count = len(made.reference.pull)
    families = {f.name: f.columns for f in (*made.discrepancy.families, *made.omitted.families)}
    at = columns.indices.get(name, families.get(name))
    best = 0.0
    for left_out, gram in enumerate(made.voyages):
        information, pull = made.prior_without(left_out)
        nominal = np.arange(1 + count)
        plain = marginal(SHARE * gram[np.ix_(nominal, nominal)], information, pull)
        for size in sizes:
            both = np.concatenate((nominal, 1 + at))
            known = np.eye(count + len(at)) / size**2
            known[:count, :count] = information
            towards = np.concatenate((pull, np.zeros(len(at))))
            value = marginal(SHARE * gram[np.ix_(both, both)], known, towards)
            best = max(best, value - plain)
    assert placebos(made)[name] == pytest.approx(best, abs=1e-6)


def test_what_all_voyages_have_alike_counts_together():
    """A drag that no number of the nominal campaign stands for, on each of its four parts. The log
    Bayes factor of one number for all of a large effect goes with the square of what is seen of it:
    about four times that of the most telling part, and at least the sum without it."""
    held = tuple(Held(c.word) if c.label == "drag" else c for c in CAUSES)
    columns = straight.columns_of(held)
    record = straight.sailed(12)
    given = straight.passed(record, columns, sensitivity=0.6)
    at = columns.indices["drag"]
    given.e[:] += given.j[..., at] @ np.full(len(at), 2.0)
    made = straight.campaign(record, given, columns, share=SHARE, deviation=0.0, size=0.1)
    parts = [placebos(replace(made, each=(g,), rows=(r,), voyage=np.zeros(1, int)))["drag"]
             for g, r in zip(made.each, made.rows, strict=True)]  # fmt: skip
    assert min(parts) > 3.0
    assert placebos(made)["drag"] == pytest.approx(sum(parts), rel=0.25)
    assert placebos(made)["drag"] > 2.0 * max(parts)


def test_a_campaign_of_no_parts_has_no_placebo():
    made = campaign(4.0)
    none = replace(made, each=(), rows=(), voyage=np.zeros(0))
    assert set(placebos(none).values()) == {0.0}


def test_what_parts_differ_by_is_no_placebo():
    """The deviation that a campaign was given: a part may have so much of its own."""
    columns = straight.columns_of(CAUSES)
    record = straight.sailed(12)
    given = straight.passed(record, columns, sensitivity=0.6)
    at = columns.indices["drag"]
    for part, value in enumerate((-1.0, 1.0, -0.6, 0.6)):
        inside = np.arange(3 * part, 3 * part + 3)
        given.e[inside] += given.j[inside][..., at] @ np.array([0.5 * value])
    strict, free = (
        placebos(straight.campaign(record, given, columns, deviation=d, size=0.1))["drag"]
        for d in (0.02, 1.0)
    )
    assert strict > 10.0
    assert free < 1.0
