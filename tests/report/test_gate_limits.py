"""limits.toml: what can stand in it, and in which words what cannot is refused."""

import pytest
from own_causes import GOOD

from shiplog.models.causes import user
from shiplog.nomenclature.channels import STATE
from shiplog.report.gate import cause_names, limits_file
from shiplog.report.gate.limits_file import LimitsError, given, parse

WHOLE = """
window_s = 60
[simulation]
loss = 3000
loss_of_hold = 0.5
loss_of_least_squares = 1
end_position_m = 4.0
end_heading_deg = 20.0
rmse_surge_mps = 0.05
rmse_sway_mps = 0.05
rmse_yaw_rate_degps = 1.0
covered = 0.8
[voyages."june_*"]
loss = 4000
[band]
x0 = 0.8
yaw_rate = 0.8
[diagnosis]
allowed = ["none", "named"]
causes_allowed = []
causes_not_allowed = ["fouling", "clock_offset:wind"]
[sizes]
current.speed = 0.05
"clock_offset:gnss".time = 0.2
rudder_offset.port = 2
"""


def test_every_key_of_the_page_is_read():
    limits = parse(WHOLE, "limits.toml")
    assert limits.window_s == 60
    assert given(limits.simulation)["loss"] == 3000.0 and len(given(limits.simulation)) == 9
    assert given(limits.voyages["june_*"]) == {"loss": 4000.0}
    assert given(limits.band) == {"x0": 0.8, "yaw_rate": 0.8}
    assert limits.diagnosis.allowed == ("none", "named")
    assert limits.diagnosis.causes_allowed == ()
    assert limits.sizes["clock_offset:gnss"] == {"time": 0.2}
    limits_file.check_names(limits, "limits.toml", (), ("port", "starboard", "propeller"))


def test_channels_of_the_band_are_those_of_the_state():
    assert list(limits_file.Band.model_fields) == [channel.name for channel in STATE]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "holds no limit"),
        ("[simulation]", "holds no limit"),
        ("window_s = 100", "holds no limit"),
        ("[diagnosis]", "holds no limit"),
        ("[simulation\nloss = 3", "is no TOML"),
        ("[simulation]\nloss = 3\nloss = 4", "is no TOML"),
        ("[simulatoin]\nloss = 3", "simulatoin is not a known key (did you mean 'simulation'?)"),
        ("[simulation]\nlos = 3", "simulation.los is not a known key (did you mean 'loss'?)"),
        ("[voyages.one]\nend_m = 3", "voyages.one.end_m is not a known key"),
        ("[voyages]\none = 3", "voyages.one has to be a section"),
        ("loss = 3", "loss belongs into the section [simulation]"),
        ("[simulation]\nsway = 0.8", "simulation.sway belongs into the section [band]"),
        ("los = 3", "los is not a known key (known: band, diagnosis, simulation,"),
        ("[simulation]\nloss = 0", "simulation.loss has to be above 0"),
        ("[simulation]\nloss = -1", "simulation.loss has to be above 0"),
        ("[simulation]\nloss = '3'", "simulation.loss has to be a number"),
        ("[simulation]\nloss = true", "simulation.loss has to be a number"),
        ("[simulation]\nloss = nan", "simulation.loss has to be a finite number"),
        ("[simulation]\nloss = inf", "simulation.loss has to be a finite number"),
        ("[simulation]\ncovered = 80", "simulation.covered has to be a share, from 0 to 1"),
        ("[band]\nheave = 0.8", "band.heave is not a known key"),
        ("simulation = 3", "simulation has to be a section"),
        ("[diagnosis]\nallowed = 'none'", "diagnosis.allowed has to be a list of texts"),
        ("[diagnosis]\nallowed = []", "diagnosis.allowed is empty"),
        ("[diagnosis]\nallowed = ['non']", "'non' is no verdict (did you mean 'none'?)"),
        ("[sizes]\ncurrent = 0.1", "sizes.current has to be a section"),
        ("[sizes]\ncurrent.speed = 'a'", "sizes.current.speed has to be a number"),
        ("[sizes]\ncurrent = {}", "sizes.current is empty"),
        ('"\\u001b[2J" = 1', r"my.toml cannot be used: \x1b[2J is not a known key"),
        ("x = " + "[" * 5000, "is no TOML"),
        ("[simulation]\nloss = 1" + "0" * 400, "simulation.loss has to be a number"),
        ("window_s = 0.5\n[simulation]\nloss = 1", "window_s"),
    ],
)
def test_what_names_nothing_is_refused_in_one_sentence(text, words):
    with pytest.raises(LimitsError) as raised:
        parse(text, "my.toml")
    assert words in raised.value.message and raised.value.message.startswith("my.toml")
    assert "pydantic" not in str(raised.value) and raised.value.hint
    assert raised.value.message.isprintable()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[diagnosis]\ncauses_not_allowed = ['curent']", "no cause 'curent' (did you mean"),
        ("[diagnosis]\ncauses_allowed = ['tide']", "no cause 'tide'"),
        ("[sizes]\nfoulin.factor = 0.1", "no cause 'foulin' (did you mean 'fouling'?)"),
        ("[sizes]\nfouling.factr = 0.1", "no number 'factr' (did you mean 'factor'?)"),
        ("[sizes]\ncurrent.direction = 0.1", "which way, and not how much"),
        ("[sizes]\npayload.position = 0.1", "which way, and not how much"),
        ("[sizes]\nside_thrust.force = 0.1", "no size that a limit can be set on"),
        ("[sizes]\n'clock_offset:gns'.time = 0.1", "has no 'gns' (did you mean 'gnss'?)"),
        ("[sizes]\n'thrust_loss:prot'.factor = 0.1", "has no 'prot' (did you mean 'port'?)"),
    ],
)  # fmt: skip
def test_a_cause_or_a_number_that_there_is_not(text, words):
    limits = parse(text, "my.toml")
    with pytest.raises(LimitsError) as raised:
        limits_file.check_names(limits, "my.toml", (), ("port", "starboard"))
    assert words in raised.value.message and raised.value.hint


def test_a_cause_of_the_user_s_own_is_known_by_its_file(tmp_path):
    (tmp_path / "mine.py").write_text(GOOD, encoding="utf-8")
    own = user.load([tmp_path / "mine.py"])
    name, number = own[0].name, own[0].parameters[0]
    limits = parse(f"[sizes]\n{name}.{number.name} = 1", "my.toml")
    limits_file.check_names(limits, "my.toml", own, ())
    assert cause_names.unit_of(name, number.name, own) == number.unit
    with pytest.raises(LimitsError) as raised:
        limits_file.check_names(limits, "my.toml", (), ())
    assert name in raised.value.message and "--cause" in raised.value.hint


def test_limits_of_another_window():
    limits = parse("[simulation]\nloss = 3", "my.toml")
    limits_file.check_window(limits, "my.toml", "mmg", 100)
    with pytest.raises(LimitsError, match="windows of 100 s, and mmg has windows of 60 s"):
        limits_file.check_window(limits, "my.toml", "mmg", 60)
    of_verdict = parse("[diagnosis]\nallowed = ['none']", "my.toml")
    limits_file.check_window(of_verdict, "my.toml", "mmg", 60)


def test_files_that_are_not_there_or_no_text(tmp_path):
    with pytest.raises(LimitsError, match="does not exist"):
        limits_file.load(tmp_path / "no.toml")
    with pytest.raises(LimitsError, match="is a folder"):
        limits_file.load(tmp_path)
    (tmp_path / "bad.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(LimitsError, match="cannot be read"):
        limits_file.load(tmp_path / "bad.toml")
