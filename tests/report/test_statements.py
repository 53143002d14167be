"""Paired differences against numbers worked out by hand, and Student's table."""

import math

import polars as pl
import pytest

from shiplog.report.paper import statements


def losses(**sets):
    return pl.DataFrame(
        [
            {"set": name.replace("_", "-"), "seed": seed, "loss": float(loss)}
            for name, each in sets.items()
            for seed, loss in enumerate(each)
        ]
    )


def found(frame, left):
    return statements.differences(frame).filter(pl.col("left") == left).row(0, named=True)


def test_the_ratio_is_of_pairs_and_its_interval_students():
    """ln ratios of -1, -2, -3: mean -2, standard error 1/√3; t(2) at 1 - 0.05/16 is 12.59."""
    ref = [7.0, 100.0, 3.0]
    other = [r * math.exp(-k) for r, k in zip(ref, (1, 2, 3), strict=True)]
    row = found(losses(ref=ref, sli2=other), "sli2")
    assert row["ratio"] == pytest.approx(math.exp(-2.0))
    half = 12.590 / math.sqrt(3.0)  # scipy and printed tables agree to the digits printed
    assert math.log(row["high"]) == pytest.approx(-2.0 + half, abs=0.01)
    assert math.log(row["low"]) == pytest.approx(-2.0 - half, abs=0.01)
    assert row["finding"] == statements.UNCLEAR  # it may well be 1


def test_a_statement_holds_fails_or_is_unclear():
    ref = [100.0, 101.0, 99.0, 100.0, 102.0]
    frame = losses(
        ref=ref, sli2=[0.5 * r for r in ref[:-1]] + [52.0],  # half of it, every time
        jit10=[2.0 * r for r in ref[:-1]] + [205.0],  # twice
        jit2=[50.0, 200.0, 60.0, 180.0, 100.0],  # now this, now that
        sli10=[51.0, 49.5, 50.0, 50.2, 51.5],
    )  # fmt: skip
    assert found(frame, "sli2")["finding"] == statements.HOLDS
    assert found(frame, "jit10")["finding"] == statements.FAILS
    assert found(frame, "jit2")["finding"] == statements.UNCLEAR
    same = statements.differences(frame).filter(pl.col("right") == "sli2").row(0, named=True)
    assert same["finding"] == statements.HOLDS  # "no significant difference", and there is none
    wide = losses(ref=[1, 1, 1], sli2=[50, 200, 60], sli10=[60, 150, 70])
    some = statements.differences(wide).filter(pl.col("right") == "sli2").row(0, named=True)
    assert some["finding"] == statements.UNCLEAR  # three seeds cannot tell


def test_more_measured_data_is_held_against_the_best_augmented_set():
    frame = losses(ref=[9, 9.1], sli2=[5, 5.1], sli10=[4, 4.1], d_ref=[1, 1.01])
    row = found(frame, "d-ref")
    assert row["right"] == "sli10"
    assert row["ratio"] == pytest.approx(math.sqrt(1 / 4 * 1.01 / 4.1))


def test_more_measured_data_beats_every_augmentation_or_it_is_not_shown():
    """Surely better than the best, and now better, now worse than another one: not every. Surely
    worse than one of three is the contrary, whatever the others."""
    five = [100.0, 101.0, 99.0, 100.0, 102.0]
    better = {"sli2": five, "sli10": [1.1 * x for x in five], "jit2": [1.3 * x for x in five]}
    d_ref = [0.5 * x for x in five[:-1]] + [52.0]
    assert found(losses(d_ref=d_ref, **better), "d-ref")["finding"] == statements.HOLDS
    noisy = better | {"jit2": [20.0, 900.0, 25.0, 800.0, 100.0]}
    row = found(losses(d_ref=d_ref, **noisy), "d-ref")
    assert row["right"] == "sli2" and row["high"] < 1.0
    assert row["finding"] == statements.UNCLEAR
    assert statements.sentence(row).endswith("of sli2: not shown of every augmented set.")
    worse = better | {"jit2": [0.25 * x for x in five[:-1]] + [26.0]}
    assert found(losses(d_ref=d_ref, **worse), "d-ref")["finding"] == statements.FAILS


def test_one_seed_has_no_interval_and_shows_nothing():
    row = found(losses(ref=[9], sli2=[1]), "sli2")
    assert row["low"] is None
    assert row["finding"] == statements.UNCLEAR
    assert statements.sentence(row) == (
        "L of sli2 is 0.11 times that of ref: one seed, so no interval."
    )


def test_a_training_that_ran_away_is_left_out_of_its_pair():
    row = found(losses(ref=[9, 9, 9], sli2=[3, math.inf, 3]), "sli2")
    assert row["seeds"] == 2
