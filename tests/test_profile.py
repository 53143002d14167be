"""Profiles that say what cannot be: refused in a user's words, with the key."""

import textwrap
from pathlib import Path

import pytest
import sailing

from pipelines.experiments import profile_reference
from shiplog import profile, profile_file, units
from shiplog.exceptions import ProfileError

ARM, SIGMA = "lever_arm_m = [0.7, -0.2]", "sigma = 0.01"
FINITE = "has to be a finite number"


@pytest.mark.parametrize("name", profile_file.shipped())
def test_every_shipped_profile_is_taken(name):
    assert profile_file.load(name).source == name


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (ARM, "lever_arm_m = [nan, 0.0]", f"sensors.position.lever_arm_m.0 {FINITE}"),
        (ARM, "lever_arm_m = [0.0, 1e999]", f"sensors.position.lever_arm_m.1 {FINITE}"),
        ("length_m = 3.0", "length_m = inf", f"ship.length_m {FINITE}"),
        ("length_m = 3.0", "length_m = -3.0", "ship.length_m has to be greater than 0"),
        (SIGMA, "sigma = -5", "sensors.position.sigma has to be greater than or equal to 0"),
        (SIGMA, "sigma = [0.1, -0.1]", "sensors.position.sigma.1 has to be greater than or equal"),
        (SIGMA, "sigma = nan", f"sensors.position.sigma {FINITE}"),
        (SIGMA, "sigma = []", "sensors.position.sigma is missing"),
        (SIGMA, "sigma = 'a'", "sensors.position.sigma has to be a number"),
        ("sign = -1.0", "sign = inf", f"actuators.0.sign {FINITE}"),
        ("[-35.0, 35.0]", "[35.0, -35.0]", "the lower one stands first"),
        ("[-35.0, 35.0]", "[-inf, inf]", f"actuators.0.limits.0 {FINITE}"),
        ('name = "rudder"\n', 'name = "../../x"\n', "letters, digits and underscores only"),
        ("[ship]", "[site]\ndatum = [nan, 0.0]\n[ship]", f"site.datum.0 {FINITE}"),
        ("[ship]", "[table]\n'v [m/s]' = {channel='sway', sign=nan}\n[ship]",
         f"table.v [m/s].sign {FINITE}"),
        ("[ship]", "x = " + "9" * 6000 + "\n[ship]", "not valid TOML"),
        ("[ship]", "x = " + "[" * 20_000 + "]" * 20_000 + "\n[ship]", "not valid TOML"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused_with_its_key(old, new, words):
    assert old in sailing.PROFILE
    with pytest.raises(ProfileError) as found:
        sailing.profile(sailing.PROFILE.replace(old, new))
    assert words in found.value.message and found.value.hint
    assert "constrained" not in found.value.message and "tuple[" not in found.value.message


def test_a_profile_that_is_no_text_or_no_file(tmp_path):
    bad = tmp_path / "bad.toml"
    bad.write_bytes(b"\xff\xfe[ship]")
    with pytest.raises(ProfileError, match="UTF-8"):
        profile_file.load(bad)
    with pytest.raises(ProfileError, match="is a folder"):
        profile_file.load(tmp_path)


def test_the_reference_is_what_the_code_reads():
    page = (Path(__file__).parent.parent / "docs" / "profile.md").read_text(encoding="utf-8")
    assert page == profile_reference.text(), (
        "python -m pipelines.experiments.profile_reference --markdown ..."
    )


def test_the_reference_has_every_key_kind_channel_and_unit():
    page = profile_reference.text()
    sections = (profile.Ship, profile.Sensor, profile.Actuator, profile.Site, profile.Column)
    keys = {key for section in sections for key in section.model_fields}
    kinds = {f'"{kind}"' for each in profile.SENSOR_KINDS.values() for kind in each}
    channels = {name for names in profile.TABLE_CHANNELS.values() for name in names}
    for word in (
        *keys,
        *kinds,
        *channels,
        *profile.TABLE_LABELS,
        *units.TO_SI,
        *profile_file.shipped(),
    ):
        assert f"`{word}`" in page
    example = page[page.index("    [ship]") : page.index("Position, velocity and heading")]
    ship = profile_file.parse(textwrap.dedent(example), "docs/profile.md")
    assert ship.sensors.position.lever_arm_m == (3.2, 0.0)


@pytest.mark.parametrize(
    ("sensors", "words"),
    [
        (("position", "velocity"), "has no heading,"),
        (("heading",), "has no position and no velocity,"),
        ((), "has no position and no velocity and no heading,"),
    ],
)
def test_what_a_log_does_not_have_is_reported_with_what_records_it(sensors, words):
    sections = sailing.PROFILE.split("[sensors.")
    kept = [part for part in sections[1:] if part.startswith(sensors)]
    ship, actuators = sections[0], "[[actuators]]" + sailing.PROFILE.split("[[actuators]]", 1)[1]
    text = "".join((ship, *(f"[sensors.{part}" for part in kept), actuators))
    with pytest.raises(ProfileError) as refused:
        profile_file.parse(text, "circle.toml")
    assert words in str(refused.value)
    assert ("record a gyro or a GNSS compass" in str(refused.value)) == ("heading" not in sensors)
