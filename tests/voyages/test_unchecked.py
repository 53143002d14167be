"""What a draft leaves open does not train a model in silence."""

import logging

import pytest
import sailing

from shiplog.exceptions import ProfileError
from shiplog.ship_profile import file as profile_file
from shiplog.training.settings.options import TrainOptions
from shiplog.voyages.ingest.ingest import ingest
from shiplog.voyages.store.store import Store
from shiplog.voyages.store.unchecked import matters, refuse_unchecked

OPEN = (
    sailing.PROFILE.replace("length_m = 3.0", "length_m = 1.0  # CHECK: the log does not say")
    .replace("sigma = 0.05", "sigma = 0.05  # CHECK")
    .replace('unit = "rpm"', 'unit = "rpm"  # CHECK\nposition_m = [-1.4, 0.0]  # CHECK')
)


@pytest.fixture
def ingested(tmp_path):
    """The store's answer for a voyage that was ingested by the profile in this file."""
    path = tmp_path / "ship.toml"
    path.write_text(OPEN)
    log = sailing.write(tmp_path / "a.mcap")
    store = Store(tmp_path / "store")
    store.add(ingest(log, profile_file.load(path)))
    return path, Store(tmp_path / "store").profile(["a"])


def test_the_store_keeps_what_is_not_looked_over(ingested):
    _, profile = ingested
    assert profile.unchecked == (
        "ship.length_m", "sensors.heading.sigma", "actuators.propeller.unit",
        "actuators.propeller.position_m",
    )  # fmt: skip


@pytest.mark.parametrize(
    ("physical", "named", "unnamed"),
    [(True, ("ship.length_m", "propeller.unit", "propeller.position_m"), ("sigma",)),
     (False, ("propeller.unit",), ("ship.length_m", "propeller.position_m", "sigma"))],
    ids=["physics", "network"],
)  # fmt: skip
def test_a_training_is_refused_by_the_keys_that_its_model_has(ingested, physical, named, unnamed):
    path, profile = ingested
    with pytest.raises(ProfileError) as refused:
        refuse_unchecked([profile, profile], physical, allowed=False)
    assert all(key in refused.value.message for key in named)
    assert not any(key in refused.value.message for key in unnamed)
    assert str(path) in refused.value.message
    assert "delete the word CHECK" in refused.value.hint and "--unchecked" in refused.value.hint


def test_with_unchecked_they_are_said_and_no_more(ingested, caplog):
    with caplog.at_level(logging.WARNING):
        refuse_unchecked([ingested[1]], True, allowed=True)
    assert "ship.length_m" in caplog.text


@pytest.mark.parametrize("left", [(), ("ship.length_m",)])
def test_a_word_that_is_deleted_needs_no_other_ingest(ingested, left):
    path, profile = ingested
    path.write_text("\n".join(
        line if any(key.partition(".")[2] in line for key in left) else line.replace("CHECK", "")
        for line in OPEN.splitlines()
    ))  # fmt: skip
    if not left:
        refuse_unchecked([profile], True, allowed=False)
        return
    with pytest.raises(ProfileError, match=r"CHECK at ship.length_m:"):
        refuse_unchecked([profile], True, allowed=False)


def test_a_value_that_was_changed_since_needs_one(ingested):
    path, profile = ingested
    path.write_text(OPEN.replace("CHECK", "").replace("length_m = 1.0", "length_m = 3.0"))
    with pytest.raises(ProfileError, match=r"ship.length_m"):
        refuse_unchecked([profile], True, allowed=False)


def test_a_profile_without_an_open_line_trains():
    refuse_unchecked([sailing.profile()], True, allowed=False)
    assert TrainOptions().unchecked is False


@pytest.mark.parametrize(
    ("key", "physics", "network"),
    [("ship.length_m", True, False), ("ship.name", False, False), ("table.speed", True, True),
     ("table.name", True, True), ("sensors.velocity.units", True, True),
     ("sensors.position.lever_arm_m", True, True), ("sensors.wind.sigma", False, False),
     ("sensors.heading", True, True), ("actuators.x.diameter_m", True, False),
     ("actuators.x.limits", True, True), ("actuators.x.sign", True, True),
     ("actuators.x.between", False, False)],
)  # fmt: skip
def test_which_keys_a_model_depends_on(key, physics, network):
    assert (matters(key, True), matters(key, False)) == (physics, network)
