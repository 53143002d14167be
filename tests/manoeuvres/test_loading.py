"""R = T F/B, and the displacement of a second draught."""

import numpy as np
import pytest

from shiplog.exceptions import ProfileError
from shiplog.manoeuvres import loading
from shiplog.manoeuvres.quantity import Estimate
from shiplog.ship_profile import file as profiles

T = {"advance": Estimate(3.0, 2.9, 3.1), "first_overshoot": Estimate(8.0, 7.5, 8.5)}


def with_draught(deep):
    profile = profiles.load("kvlcc2")
    ship = profile.ship.model_copy(update={"full_load_draught_m": deep})
    return profile.model_copy(update={"ship": ship})


def test_the_ratio_of_predictions_is_put_on_the_measurement():
    b, f = {"advance": 2.0, "first_overshoot": 10.0}, {"advance": 2.2, "first_overshoot": 12.0}
    found = loading.full_load(T, [b] * 300, [f] * 300)
    assert found["advance"].value == pytest.approx(3.0 * 1.1)
    assert found["first_overshoot"].value == pytest.approx(9.6)
    # of a ratio that is certain, the interval is the measurement's
    assert found["advance"].low == pytest.approx(2.9 * 1.1, abs=0.02)
    assert found["advance"].high == pytest.approx(3.1 * 1.1, abs=0.02)


def test_an_uncertain_ratio_widens_it():
    rng = np.random.default_rng(0)
    b = [{"advance": 2.0}] * 400
    f = [{"advance": 2.2}, *({"advance": 2.2 + 0.2 * x} for x in rng.standard_normal(399))]
    one = loading.full_load(T, b, f)["advance"]
    wanted = np.hypot(0.1 / 1.645 * 1.1, 3.0 * 0.1) * 1.645
    assert one.high - one.low == pytest.approx(2.0 * wanted, rel=0.15)


def test_what_one_of_both_does_not_give_is_left_out():
    assert set(loading.full_load(T, [{"advance": 2.0}], [{}])) == set()
    assert set(loading.full_load(T, [{"advance": 2.0}], [{"advance": 2.0}])) == {"advance"}


def test_a_deeper_draught_displaces_more_by_the_waterplane():
    """998 kg/m³ · C_W L B ΔT with C_W = (1 + 2 · 0.81)/3."""
    was = profiles.load("kvlcc2").ship
    ship = loading.at_full_load(with_draught(0.5)).ship
    more = 998.0 * (1.0 + 2.0 * 0.81) / 3.0 * 7.0 * 1.2688 * (0.5 - 0.455)
    assert ship.draught_m == 0.5
    assert ship.mass_kg == pytest.approx(was.mass_kg + more, rel=1e-9)


def test_without_a_second_draught_it_is_refused():
    with pytest.raises(ProfileError, match="full_load_draught_m"):
        loading.at_full_load(profiles.load("kvlcc2"))


def test_a_profile_without_it_is_the_same_text_as_before():
    """A stored voyage is known by its profile's text."""
    profile = profiles.load("kvlcc2")
    assert "full_load" not in profile.model_dump_json()
    assert profile.model_validate(profile.model_dump()).ship == profile.ship
    again = with_draught(0.5)
    assert again.model_validate(again.model_dump()).ship.full_load_draught_m == 0.5
