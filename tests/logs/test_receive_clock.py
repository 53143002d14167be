"""Receive stamps against the UTC next to them: what is the recorder's error, and what latency."""

import numpy as np
import pytest

from shiplog.logs.conversion.receive_clock import against_utc

SECOND = 1_000_000_000
START = 1_717_236_000 * SECOND
T = np.arange(3000) / 10.0  # s: a heading at 10 Hz, and each tenth line is a fix
FIX = np.arange(3000) % 10 == 0


def lines(error, latency):
    """Receive stamps and UTC of headings that come at once, and of fixes that come late; and when
    each line came. A fix of `latency` comes in its turn, and is of so long before."""
    error = np.broadcast_to(error, T.shape)
    received = START + np.rint((T + error) * SECOND).astype(np.int64)
    utc = np.where(FIX, START + np.rint((T - latency) * SECOND).astype(np.int64), -1)
    return received, utc


def put_right(received, found):
    return (received - found.wrong - START) * 1e-9


@pytest.mark.parametrize("latency", [0.02, 0.2, 0.5, 0.8, 1.06, 1.4])
def test_the_latency_of_a_receiver_is_no_error_of_the_recorder(latency):
    received, utc = lines(0.0, latency)
    found = against_utc(received, utc)
    assert not found.wrong.any()
    assert found.latency_s == pytest.approx(latency, abs=1e-6)
    assert [f"{latency:.2g} s after their fix" in f.sentence for f in found.findings] == (
        [True] if latency >= 0.2 else []
    )


@pytest.mark.parametrize("latency", [0.02, 0.4, 0.8])
@pytest.mark.parametrize("hours", [-5, 1, 2, 10])
def test_whole_hours_are_a_zone_and_what_is_left_is_latency(latency, hours):
    received, utc = lines(3600.0 * hours, latency)
    found = against_utc(received, utc)
    assert put_right(received, found) == pytest.approx(T, abs=1e-6)
    assert "whole hours as of a zone" in found.findings[0].sentence


@pytest.mark.parametrize("error", [-40.0, -2.5, 2.5, 7.0, 86_400.0 * 30 + 5])
def test_a_clock_that_is_off_is_put_right_up_to_the_latency_that_nothing_shows(error):
    received, utc = lines(error, 0.4)
    found = against_utc(received, utc)
    assert put_right(received, found) == pytest.approx(T - 0.4, abs=1e-6)
    (finding,) = found.findings
    assert finding.value == pytest.approx(error + 0.4, abs=1e-3)
    assert finding.low <= error <= finding.high
    assert "latency" in finding.sentence


@pytest.mark.parametrize("before", [-2.5, -0.6, 0.6, 3.0, -3600.0])
@pytest.mark.parametrize("latency", [0.03, 0.4])
def test_a_clock_that_is_set_while_it_records_is_right_before_and_after(before, latency):
    received, utc = lines(np.where(T < 123.45, before, 0.0), latency)
    found = against_utc(received, utc)
    assert put_right(received, found) == pytest.approx(T, abs=1e-6)
    assert found.findings[0].kind == "clock_offset"
    assert "set while it recorded" in found.findings[0].sentence
    assert found.findings[0].value == pytest.approx(before, abs=1e-3)


def test_a_clock_that_is_set_twice_has_three_pieces():
    error = np.where(T < 60.0, -4.0, np.where(T < 200.0, 0.0, 5.0))
    received, utc = lines(error, 0.1)
    assert put_right(received, against_utc(received, utc)) == pytest.approx(T, abs=1e-6)


def test_a_receiver_that_becomes_slower_moves_no_stamp():
    received, utc = lines(0.0, np.where(T < 150.0, 0.2, 0.9))
    found = against_utc(received, utc)
    assert not found.wrong.any()


def test_a_clock_that_drifts_is_held_against_the_utc_beside_each_stamp():
    error = 0.01 * T - 1.0  # 1 % is a bad clock: from 1 s behind to 2 s ahead
    received, utc = lines(error, 0.0)
    found = against_utc(received, utc)
    assert put_right(received, found) == pytest.approx(T, abs=0.02)
    assert "drifts" in found.findings[0].sentence


def test_latency_that_scatters_is_latency():
    rng = np.random.default_rng(1)
    received, utc = lines(0.0, rng.uniform(0.2, 0.9, len(T)))
    found = against_utc(received, utc)
    assert not found.wrong.any()
    assert len(found.findings) == 1


def test_a_date_that_jumps_back_and_forth_moves_no_stamp():
    """A gateway's placeholder of 2005 between the receiver's fixes."""
    received, utc = lines(0.0, 0.1)
    utc = np.where(FIX & (np.arange(3000) % 20 == 0), 1_104_537_600 * SECOND, utc)
    assert not against_utc(received, utc).wrong.any()


def test_each_sentence_has_a_latency_of_its_own_and_the_steadiest_counts():
    kind = np.arange(3000) // 10 % 2
    received, utc = lines(np.where(T < 150.0, -2.5, 0.0), np.where(kind == 0, 0.2, 0.8))
    found = against_utc(received, utc, kind)
    assert put_right(received, found) == pytest.approx(T, abs=1e-6)


def test_without_utc_or_without_stamps_nothing_is_said():
    none = np.full(50, -1)
    for received, utc in ((none, START + np.arange(50)), (START + np.arange(50), none), ([], [])):
        found = against_utc(np.array(received, np.int64), np.array(utc, np.int64))
        assert not found.wrong.any()
        assert found.findings == ()
