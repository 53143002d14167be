"""The KVLCC2 of the package shipmmg in its own zigzag test and turn, and as we sail it.

Its equations are its own, and so are the integrator and the zigzag's rule; only the quantities are
measured by the same code.
"""

import functools
import math

import numpy as np
import pytest

from shiplog.manoeuvres import turning, zigzags
from shiplog.manoeuvres.track import Track
from shiplog.simulation.controls import Controls
from shiplog.simulation.helm import helm
from shiplog.simulation.sailing import Steps, sail
from shiplog.simulation.schedules import Turn, Zigzag

mmg_3dof = pytest.importorskip("shipmmg.mmg_3dof")

from pipelines.experiments.other_families import shipmmg_kvlcc2 as kvlcc2  # noqa: E402

U0, TURNS, GEAR, STEP = 1.179, 10.4, math.radians(15.8), 0.1  # as in the tank at 1:45.7
SQUARE = 0.5 * kvlcc2.DENSITY * kvlcc2.LENGTH**2 * kvlcc2.BASIC["d"]
MASS = kvlcc2.BASIC["volume"] * kvlcc2.DENSITY
BASIC = kvlcc2.PLAIN | {
    "L_pp": 7.0, "B": 1.27, "d": 0.46, "x_G": 0.25, "D_p": 0.216, "m": MASS,
    "I_zG": MASS * (0.25 * 7.0) ** 2, "A_R": 0.0539, "η": 0.216 / 0.345,
    "m_x": 0.022 * SQUARE, "m_y": 0.223 * SQUARE, "J_z": 0.011 * SQUARE * 49.0,
    "x_R": -3.5, "x_H": -0.464 * 7.0,
}  # fmt: skip


# Its default is a relative tolerance of 1e-3, with which a circle is off by 2 %.
EXACT = {"rtol": 1e-9, "atol": 1e-9}


def parameters():
    return (
        mmg_3dof.Mmg3DofBasicParams(**BASIC), mmg_3dof.Mmg3DofManeuveringParams(**kvlcc2.HULL)
    )  # fmt: skip


@pytest.fixture(scope="module")
def rates():
    function = kvlcc2.right_hand_side(BASIC, kvlcc2.HULL)

    def of(state, actuator, wind):
        x, u, y, v, psi, r = state[0].tolist()
        return np.array([function(0.0, (u, v, r, x, y, psi, *actuator[0]))[:3]])

    return of


def ours(rates, manoeuvre, seconds):
    sticks = Controls(
        ("rudder", "propeller"), np.array([1.0, 0.0]), np.array([0.0, TURNS]), np.zeros(2),
        np.array([-0.7, 0.0]), np.array([0.7, 20.0]), np.array([GEAR, 1e9]),
    )  # fmt: skip
    start = np.zeros((1, 6))
    start[:, 1] = U0
    steps = Steps(seconds, STEP, 1, np.full(3, 20.0), heun=True)
    found = sail(rates, helm(manoeuvre, sticks, start, 7.0 / U0), sticks, start, steps)
    keep = np.isfinite(found.state[0]).all(-1)
    return Track(found.time[keep], found.state[0][keep], found.actuator[0][keep, 0],
                 found.actuator[0][keep, 1], 7.0)  # fmt: skip


def track(time, rudder, u, v, r, x, y, psi):
    state = np.stack([np.asarray(one) for one in (x, u, y, v, psi, r)], -1)
    return Track(np.asarray(time), state, np.asarray(rudder), np.ones(len(time)), 7.0)


@pytest.mark.parametrize("degrees", [35.0, -35.0])
def test_its_turn_is_ours(rates, degrees):
    """The rudder goes over at its rate; a circle and three quarters."""
    time = np.arange(0.0, 200.0, STEP)
    angle = math.radians(degrees)
    rudder = np.sign(angle) * np.minimum(GEAR * time, abs(angle))
    basic, hull = parameters()
    solved = mmg_3dof.simulate_mmg_3dof(
        basic, hull, time, rudder, np.full(len(time), TURNS), u0=U0, ρ=kvlcc2.DENSITY, **EXACT
    )
    u, v, r, x, y, psi = solved.sol(time)[:6]
    side = math.copysign(1.0, degrees)
    theirs = turning.quantities(track(time, rudder, u, v, r, x, y, psi), 0.0, side)
    mine = turning.quantities(ours(rates, Turn(angle, by=math.radians(540.0)), 200.0), 0.0, side)
    for name in ("advance", "transfer", "tactical_diameter"):
        assert mine[name] == pytest.approx(theirs[name], abs=2e-3), name
    assert 2.5 < theirs["advance"] < 4.0 and 2.5 < theirs["tactical_diameter"] < 4.5


@pytest.mark.parametrize("degrees", [10.0, 20.0])
def test_its_zigzag_is_ours(rates, degrees, monkeypatch):
    """It orders back at the first sample after the heading was passed: a tenth of a second."""
    plain = mmg_3dof.simulate_mmg_3dof  # to which the zigzag hands on no option
    monkeypatch.setattr(mmg_3dof, "simulate_mmg_3dof", functools.partial(plain, **EXACT))
    time = np.arange(0.0, 110.0, STEP)
    angle = math.radians(degrees)
    basic, hull = parameters()
    found = mmg_3dof.zigzag_test_mmg_3dof(
        basic,
        hull,
        angle,
        angle,
        list(time),
        [TURNS] * len(time),
        δ_rad_rate=GEAR,
        u0=U0,
        ρ=kvlcc2.DENSITY,
    )
    rudder, u, v, r, x, y, psi = found[:7]
    theirs = track(time, rudder, u, v, r, x, y, psi)
    mine = ours(rates, Zigzag(angle, angle, 4), 110.0)

    def measured(one):
        orders = [0.0]
        for k in range(3):
            side = 1.0 if k % 2 == 0 else -1.0
            orders.append(one.reaches(side * angle, side, orders[-1]))
        return zigzags.quantities(one, orders, 1.0, angle)

    theirs, mine = measured(theirs), measured(mine)
    for name in ("first_overshoot", "second_overshoot"):
        assert mine[name] == pytest.approx(theirs[name], abs=0.25), name
    assert mine["check_time"] == pytest.approx(theirs["check_time"], abs=0.2)
