"""Faults are found where they are, and a manoeuvre is not a fault."""

import numpy as np
import pytest

from shiplog.voyages.rows import fault_detection

RNG = np.random.default_rng(1)
TIME = np.arange(0, 60, 0.1)
GRID = np.arange(600, dtype=np.int64) * 100_000_000


def test_a_spike_is_found_and_a_step_is_not():
    value = (0.3 * TIME + RNG.normal(0, 0.01, 600))[:, None]
    value[200] += 1.0
    value[400:] += 1.0
    assert np.flatnonzero(fault_detection.spikes(value, 0.01)).tolist() == [200]


def test_a_hard_turn_is_no_spike():
    value = np.sin(2 * np.pi * TIME / 20)[:, None] * 0.5 + RNG.normal(0, 0.002, (600, 1))
    assert not fault_detection.spikes(value, 0.002).any()


def test_a_held_position_is_found_only_while_the_ship_moves():
    position = np.stack((0.5 * TIME, np.zeros(600)), axis=1)
    position[300:310] = position[299]
    runs = fault_detection.repeats(position)
    moving = fault_detection.held_on_grid(GRID, GRID, runs, 0.5 * TIME[:, None], least=0.06)
    at_rest = fault_detection.held_on_grid(GRID, GRID, runs, np.zeros((600, 1)), least=0.06)
    assert moving == [(299, 309)]
    assert at_rest == []


def test_a_steady_course_is_not_held_for_the_noise_and_the_bias_of_the_gyro():
    heading = np.full((600, 1), 0.3)
    heading[:300, 0] = 0.3 + 0.01 * (300 - np.arange(300))  # a turn, then 30 s of one heading
    rate = np.where(np.arange(600) < 300, -0.1, 0.0)
    runs = fault_detection.repeats(heading)
    noisy = rate + RNG.normal(0.001, 0.002, 600)
    turning = rate + np.where(np.arange(600) >= 300, 0.02, 0.0)  # 34 deg that it does not show
    swinging = rate + np.where(np.arange(600) >= 300, 0.1 * np.sin(2 * np.pi * TIME / 15.0), 0.0)

    def held(rate, drift=0.002):
        travel = 0.1 * np.cumsum(rate)[:, None]
        return fault_detection.held_on_grid(GRID, GRID, runs, travel, 0.02, drift)

    assert held(noisy) == []
    assert held(turning) == held(swinging) == [(300, 599)]


def test_a_coarse_instrument_is_not_called_held():
    coarse = np.round(RNG.normal(0, 0.3, 600))[:, None]
    assert fault_detection.improbable(fault_detection.repeats(coarse), 600) == []
    stuck = RNG.normal(0, 0.3, 600)[:, None]
    stuck[100] = stuck[99]
    stuck[200:215] = stuck[199]
    assert fault_detection.improbable(fault_detection.repeats(stuck), 600) == [(200, 214)]


@pytest.mark.parametrize("step", [1.0, 0.01, 1.0 / 3.0])
def test_the_step_in_which_an_instrument_counts_is_found(step):
    motion = np.cumsum(RNG.normal(0, 3.0 * step, 600))
    assert fault_detection.resolution(step * np.round(motion / step)[:, None]) == pytest.approx(
        step
    )
    assert fault_detection.resolution(motion[:, None]) == 0.0
    both = np.stack((motion, step * np.round(motion / step)), axis=1)
    assert fault_detection.resolution(both) == pytest.approx(step)


def test_an_instrument_that_hardly_moves_shows_no_step():
    assert fault_detection.resolution(np.repeat(np.arange(4.0), 100)[:, None]) == 0.0


def test_a_lost_second_is_a_jump_with_its_size():
    position = np.stack((0.5 * TIME, np.zeros(600)), axis=1) + RNG.normal(0, 0.002, (600, 2))
    position[350:, 0] += 0.5  # a second's way
    rate = np.tile([0.5, 0.0], (600, 1))
    ((row, size),) = fault_detection.jumps(position, rate, np.ones(600, bool), noise=0.002)
    assert row == 350 and abs(size - 0.5) < 0.02


def test_a_gap_that_the_ship_sailed_through_is_no_jump_but_a_clock_step_is():
    usable = np.ones(600, bool)
    usable[200:230] = False
    rate = np.tile([0.5, 0.0], (600, 1))
    sailed = np.stack((0.5 * TIME, np.zeros(600)), axis=1) + RNG.normal(0, 0.002, (600, 2))
    stepped = sailed.copy()
    stepped[230:, 0] -= 1.5  # three seconds on the clock in which the ship did not move on
    assert fault_detection.jumps(sailed, rate, usable, 0.002) == []
    assert [row for row, _ in fault_detection.jumps(stepped, rate, usable, 0.002)] == [230]


def test_long_lists_are_counted_not_cut():
    findings = fault_detection.findings_of(
        "gap", "wind", [(float(i), i + 0.5) for i in range(30)], "is silent"
    )
    assert len(findings) == fault_detection.LISTED + 1
    assert "10 more stretches" in findings[-1].sentence
    assert findings[-1].value == 5.0


@pytest.mark.parametrize("speed", [0.058, 1.2])
def test_an_even_motion_is_no_resolution(speed):
    way = speed * np.arange(600) + 1e-3 * speed * np.sin(TIME)
    assert fault_detection.resolution(way[:, None]) == 0.0
    step = 3.0 * speed
    assert fault_detection.resolution(step * np.round(way / step)[:, None]) == pytest.approx(step)


@pytest.mark.parametrize(("levels", "found"), [(2, 1.0), (4, 1.0)])
def test_a_few_values_that_come_again_show_a_step(levels, found):
    value = RNG.integers(0, levels, 400).astype(float)[:, None]
    assert fault_detection.resolution(value) == found
    assert fault_detection.resolution(np.sort(value, axis=0)) == 0.0


def test_what_a_faster_log_writes_several_times_is_no_run_of_repeats():
    value = np.repeat(RNG.normal(0, 1, 120), 5)[:, None]
    assert fault_detection.repeats(value) == []
    value[200:215] = value[200]
    assert fault_detection.repeats(value) == [(201, 214)]


def test_a_lively_stretch_of_a_quiet_record_has_no_spikes_and_a_spike_in_either_is_found():
    value = RNG.normal(0, 1e-4, 600)
    value[400:] += np.cumsum(RNG.normal(0, 0.05, 200))
    assert not fault_detection.spikes(value[:, None], 1e-4).any()
    for at, size in ((150, 0.02), (500, 3.0)):
        spiked = value.copy()
        spiked[at] += size
        assert np.flatnonzero(fault_detection.spikes(spiked[:, None], 1e-4)).tolist() == [at]


def test_a_step_is_found_and_neither_a_spike_nor_a_turn_is():
    heading = 0.2 * np.sin(2 * np.pi * TIME / 12) + RNG.normal(0, 0.001, 600)
    assert fault_detection.steps(heading, 0.001, 2 * np.pi) == []
    heading[100] += 1.0
    assert fault_detection.steps(heading, 0.001, 2 * np.pi) == []
    heading[300:] += 2 * np.pi + 0.8
    ((at, size),) = fault_detection.steps(heading, 0.001, 2 * np.pi)
    assert at == 300 and size == pytest.approx(0.8, abs=0.03)


def test_a_late_rate_makes_no_jumps():
    heading = 0.6 * np.sin(2 * np.pi * TIME / 8)[:, None]
    heading -= heading[500]
    rate = 0.6 * 2 * np.pi / 8 * np.cos(2 * np.pi * (TIME - 0.3) / 8)[:, None]
    still = np.where(TIME[:, None] < 50, 0.0, 1.0)
    usable = np.ones(600, bool)

    def found(gone):
        jumps = fault_detection.jumps(gone, still * rate, usable, 1e-4, lively=True)
        return [row for row, _ in jumps]

    assert found(still * heading) == []
    jumped = still * heading
    jumped[550:] += 0.5
    assert found(jumped) == [550]
