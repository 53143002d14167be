"""Numbers in sentences."""

import math

import pytest

from shiplog.nomenclature.numbers import counted, figure, percent


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [
        (0.0123, 2, "0.012"), (5.0, 2, "5"), (99.4, 2, "99"), (99.6, 2, "100"), (134.0, 2, "130"),
        (-134.0, 2, "-130"), (12345.0, 2, "12000"), (12345.0, 4, "12340"), (1234.6, 4, "1235"),
        (0.0, 2, "0"), (math.nan, 2, "nan"), (math.inf, 2, "inf"),
    ],
)  # fmt: skip
def test_a_large_number_has_no_power_of_ten(value, digits, text):
    assert figure(value, digits) == text


def test_one_is_singular():
    assert [counted(n, "more line") for n in (0, 1, 2)] == [
        "0 more lines", "1 more line", "2 more lines",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("share", "text"),
    [
        (0.0, "0%"), (0.0004, "0.1%"), (0.004, "0.4%"), (0.006, "1%"), (0.125, "12%"),
        (0.994, "99%"), (0.996, "99.6%"), (0.9996, "99.9%"), (1.0, "100%"), (1.234, "123%"),
        (-0.2, "-20%"),
    ],
)  # fmt: skip
def test_a_part_is_neither_nothing_nor_all(share, text):
    assert percent(share) == text
