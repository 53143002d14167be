"""What a profile and a file of coefficients say of a ship, and what is refused."""

import jax
import pytest
from mmg_ships import TUNNEL, TWIN, estimated

from shiplog.exceptions import ProfileError
from shiplog.models.mmg import parameters
from shiplog.models.mmg.geometry import geometry_of, joined, split
from shiplog.ship_profile import file as profiles

# ---------------------------------------------------------------- geometry


def test_ships_of_the_same_actuators_share_what_is_compiled(twin):
    """Sizes and places are its arguments, in the order that gives them back; which blade stands
    behind which screw, what an azimuth is turned by and the number of actuators are not."""
    numbers, shape = split(twin.model.geometry)
    assert joined(shape, iter(numbers)) == twin.model.geometry
    larger = TWIN.replace("length_m = 4.0", "length_m = 9.0").replace(
        "area_m2 = 0.02", "area_m2 = 0.05"
    )
    other = estimated(profiles.parse(larger, "larger.toml"))
    assert split(other.model.geometry)[0] != numbers
    assert jax.tree.structure(other.model) == jax.tree.structure(twin.model)
    assert hash(jax.tree.structure(other.model)) == hash(jax.tree.structure(twin.model))
    aside = TWIN.replace("position_m = [-1.8, 0.3]", "position_m = [-1.8, -0.31]")
    swapped = estimated(profiles.parse(aside, "aside.toml"))
    assert [blade.behind for blade in swapped.model.geometry.rudders] != [
        blade.behind for blade in twin.model.geometry.rudders
    ]
    assert jax.tree.structure(swapped.model) != jax.tree.structure(twin.model)


def test_the_profile_says_which_blades_are_wide(esso, vectwin):
    assert [blade.wide for blade in esso.model.geometry.rudders] == [False]
    assert [blade.wide for blade in vectwin.model.geometry.rudders] == [True, True]
    assert [blade.behind for blade in vectwin.model.geometry.rudders] == [0, 0]
    assert esso["rudder.f_t"] == 0.0  # an ordinary blade's


def test_a_blade_is_as_wide_whichever_way_its_sensor_counts():
    """sign = -1 turns limits of -105 to 35 round; an ordinary blade stays one. Offsets count."""
    wide = profiles.load("esso-vectwin")

    def blades(**update):
        """Which are wide, with every rudder's profile changed so."""
        changed = tuple(
            a.model_copy(update=update) if a.kind == "rudder" else a for a in wide.actuators
        )
        return [
            b.wide for b in geometry_of(wide.model_copy(update={"actuators": changed}))[0].rudders
        ]

    for sign in (1.0, -1.0):
        assert blades(sign=sign) == [True, True]
        assert blades(sign=sign, limits=(-105.0, 35.0)) == [True, True]
        assert blades(sign=sign, limits=(-35.0, 35.0)) == [False, False]
        assert blades(sign=sign, limits=(55.0, 125.0), offset=90.0) == [False, False]
    assert blades(limits=None) == [False, False]


def test_a_command_without_a_unit_is_reported_with_what_it_is_taken_as():
    """Half of a servo's travel, 400 µs, is a command of 1."""
    ship = profiles.load("esso-osaka")
    units = {"rudder": "%", "propeller": "pwm"}
    raw = tuple(
        a.model_copy(update={"unit": units[a.kind]}) if a.kind in units else a
        for a in ship.actuators
    )
    notes = geometry_of(ship.model_copy(update={"actuators": raw}))[2]
    assert [n for n in notes if "rudder" in n and "100 % is taken as 1 rad" in n]
    assert [n for n in notes if "propeller" in n and "400 pwm is taken as 1 rev/s" in n]
    assert not [n for n in geometry_of(ship)[2] if "is taken as" in n]
    without = geometry_of(ship.model_copy(update={"actuators": raw}), ("rudder",))[2]
    assert ["rudder" in n for n in without if "is taken as" in n] == [False]


@pytest.mark.parametrize(
    ("key", "actuator", "part"),
    [
        ("diameter_m", "propeller", "propeller"),
    ],
)
def test_a_size_that_is_missing_is_asked_for_by_name(key, actuator, part):
    ship = profiles.load("esso-osaka")
    lacking = tuple(
        a.model_copy(update={key: None}) if a.name == actuator else a for a in ship.actuators
    )
    with pytest.raises(ProfileError) as error:
        geometry_of(ship.model_copy(update={"actuators": lacking}))
    assert f"no {key}" in str(error.value) and repr(actuator) in str(error.value)
    assert f"--without {part}" in error.value.hint
    geometry_of(ship.model_copy(update={"actuators": lacking}), without=[part])


def test_forces_can_be_left_out(esso):
    ship = profiles.load("esso-osaka")
    assert esso.model.geometry.parts == ("hull", "propeller", "rudder", "wind")
    for part in ("propeller", "rudder", "wind"):
        found, _, _ = geometry_of(ship, without=[part])
        assert part not in found.parts and len(found.parts) == 3
        assert not any(name.startswith(part) for name in parameters.names(found))
    tunnel = profiles.parse(TUNNEL, "tunnel.toml")
    assert geometry_of(tunnel)[0].parts == ("hull", "thruster")  # no sensor of the wind
    assert geometry_of(tunnel, without=["thruster"])[0].parts == ("hull",)


@pytest.mark.parametrize("part", ["hull", "winds"])
def test_what_cannot_be_left_out_is_refused(part):
    with pytest.raises(ProfileError, match=f"no force '{part}'") as error:
        geometry_of(profiles.load("esso-osaka"), without=[part])
    assert "propeller, rudder, thruster, wind" in error.value.hint
    assert ("did you mean 'wind'" in str(error.value)) == (part == "winds")


# ---------------------------------------------------------------- parameters


def test_parameters_survive_a_file(esso, tmp_path):
    moved = esso.parameters.with_values(esso.parameters.values * 0.999, source="made up")
    path = tmp_path / "ship.mmg.toml"
    path.write_text(moved.to_toml(), encoding="utf-8")
    again = parameters.load(path, esso.model.geometry)
    assert again.names == moved.names and again.source == "made up"
    assert again.values.tolist() == moved.values.tolist()


def test_published_values_have_half_the_spread_of_estimated_ones(esso):
    """30 % of a hull coefficient or its least, and twice that."""
    found = dict(zip(esso.parameters.names, esso.parameters.spread, strict=True))
    assert found["hull.y_v"] == pytest.approx(0.3 * 0.3728)
    assert found["hull.x_vr"] == 0.08
    assert found["rudder.f_t"] == 0.3
    guess = estimated(profiles.load("esso-osaka"))
    wide = dict(zip(guess.parameters.names, guess.parameters.spread, strict=True))
    assert wide["hull.y_v"] == pytest.approx(-2 * 0.3 * guess["hull.y_v"])
    assert (guess.parameters.low <= guess.parameters.values).all()
    assert (guess.parameters.values <= guess.parameters.high).all()


def test_names_follow_the_parts_and_a_thrusters_are_its_own(esso):
    assert esso.model.names == esso.parameters.names
    assert len(esso.model.names) == 3 + 15 + 27 + 13 + 10
    assert esso.model.names[:4] == ("body.m_x", "body.m_y", "body.i_j", "hull.x_0f")
    tunnel, _, _ = geometry_of(profiles.parse(TUNNEL, "tunnel.toml"))
    wanted = [f"thruster.{n}_{k}" for n in ("bow", "pod") for k in ("ahead", "astern", "loss")]
    assert list(parameters.names(tunnel)[18:]) == wanted
    assert esso.parameters.entry("hull.y_v").symbol == "Y'_v"
    assert estimated(profiles.parse(TUNNEL, "t")).parameters.entry(wanted[5]).unit == "s/m"


def edited(tmp_path, old, new):
    text = parameters.published_file("esso-osaka").read_text(encoding="utf-8")
    assert old in text
    path = tmp_path / "edited.mmg.toml"
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("y_v = -0.3728", "y_v = 0.3728", ["hull.y_v", "Y'_v", "0.3728", "-3 to 0"]),
        ("c_d = 0.9665", "c_d = -0.9665", ["hull.c_d", "C_D", "-0.9665", "0 to 4"]),
        ("m_x = 0.0467", "m_x = nan", ["body.m_x", "nan"]),
        ("k0 = 0.3278", "k0 = 0.3278\nk_0 = 1", ["propeller.k_0", "did you mean 'k0'"]),
        ("[wind]", "[winds]", ["[winds]", "did you mean 'wind'", "sections are"]),
        ("a_h = 0.393", "", ["lacks rudder.a_h", "--without rudder"]),
        ("eps = 1.42", "eps = 1.42 eps", ["not valid TOML"]),
        ("eps = 1.42", 'eps = "1.42"', ["rudder.eps", "'1.42'", "not a number"]),
        ("eps = 1.42", "eps = true", ["rudder.eps", "True", "not a number"]),
        ("eps = 1.42", "eps = [1.42]", ["rudder.eps", "not a number"]),
        ("eps = 1.42", "eps = 1" + 400 * "0", ["rudder.eps", "inf", "0.2 to 3"]),
        ("eps = 1.42", "eps = 1" + 6000 * "0", ["not valid TOML"]),
        ("eps = 1.42", "eps = " + 20_000 * "[", ["not valid TOML"]),
    ],
    ids=[
        "high",
        "low",
        "nan",
        "key",
        "section",
        "missing",
        "syntax",
        "string",
        "bool",
        "array",
        "400 digits",
        "6000 digits",
        "nested",
    ],
)
def test_a_file_that_cannot_be_is_refused_with_its_name(esso, tmp_path, old, new, words):
    path = edited(tmp_path, old, new)
    with pytest.raises(ProfileError) as error:
        parameters.load(path, esso.model.geometry)
    for word in [str(path), *words]:
        assert word in str(error.value)


def test_a_number_where_a_section_belongs_is_refused(esso, tmp_path):
    text = parameters.published_file("esso-osaka").read_text(encoding="utf-8")
    path = tmp_path / "scalar.mmg.toml"
    path.write_text("wind = 0.3\n" + text[: text.index("[wind]")], encoding="utf-8")
    with pytest.raises(ProfileError, match=r"scalar\.mmg\.toml: wind is 0\.3, not") as error:
        parameters.load(path, esso.model.geometry)
    assert "[wind]" in error.value.hint


def test_a_file_that_is_not_utf_8_is_refused(esso, tmp_path):
    path = tmp_path / "latin.mmg.toml"
    path.write_bytes('source = "Universität"'.encode("latin-1"))
    with pytest.raises(ProfileError, match=r"latin\.mmg\.toml is not valid TOML"):
        parameters.load(path, esso.model.geometry)


def test_a_missing_hull_is_not_advised_to_be_left_out(esso, tmp_path):
    """There is no --without hull, nor --without body."""
    for old in ("y_v = -0.3728", "m_y = 0.2579"):
        with pytest.raises(ProfileError, match="lacks") as error:
            parameters.load(edited(tmp_path, old, ""), esso.model.geometry)
        assert error.value.hint == "add them."
    text = parameters.published_file("esso-osaka").read_text(encoding="utf-8")
    both = text.replace("y_v = -0.3728", "").replace("a_h = 0.393", "")
    path = tmp_path / "both.mmg.toml"
    path.write_text(both, encoding="utf-8")
    with pytest.raises(ProfileError, match=r"lacks hull\.y_v, rudder\.a_h") as error:
        parameters.load(path, esso.model.geometry)
    assert error.value.hint == "add them, or leave the force out with --without rudder."


def test_a_thruster_that_the_ship_lacks_is_refused(tmp_path):
    g, main, _ = geometry_of(profiles.parse(TUNNEL, "tunnel.toml"))
    text = parameters.estimated(g, main).to_toml()
    path = tmp_path / "tunnel.mmg.toml"
    path.write_text(text, encoding="utf-8")
    assert parameters.load(path, g).names == parameters.names(g)
    path.write_text(text.replace("bow_loss", "bow_lost"), encoding="utf-8")
    with pytest.raises(ProfileError, match=r"thruster\.bow_lost is not a coefficient") as error:
        parameters.load(path, g)
    assert "did you mean 'bow_loss'" in str(error.value)
    assert "pod_astern" in error.value.hint and "hull" not in error.value.hint


def test_a_whole_part_that_is_missing_is_named_and_can_be_left_out(tmp_path):
    text = parameters.published_file("esso-osaka").read_text(encoding="utf-8")
    path = tmp_path / "calm.mmg.toml"
    path.write_text(text[: text.index("[wind]")], encoding="utf-8")
    ship = profiles.load("esso-osaka")
    with pytest.raises(ProfileError, match=r"lacks wind\.n1") as error:
        parameters.load(path, geometry_of(ship)[0])
    assert "--without wind" in error.value.hint
    calm = geometry_of(ship, without=["wind"])[0]
    assert parameters.load(path, calm).names == parameters.names(geometry_of(ship)[0])[:58]
    with pytest.raises(ProfileError, match="cannot be read"):
        parameters.load(tmp_path / "nowhere.toml", geometry_of(ship)[0])


def test_a_section_of_a_force_that_the_ship_lacks_is_refused_unless_it_was_left_out():
    path = parameters.published_file("esso-osaka")
    calm = geometry_of(profiles.load("esso-osaka"), without=["wind"])[0]
    with pytest.raises(ProfileError, match="has a wind force") as error:
        parameters.load(path, calm)
    assert "no [sensors.wind]" in str(error.value) and "--without wind" in error.value.hint
    assert not any("wind" in name for name in parameters.load(path, calm, without=["wind"]).names)


def test_published_values_lie_next_to_their_profile(tmp_path):
    assert parameters.published_file("esso-osaka").name == "esso-osaka.mmg.toml"
    assert (
        parameters.published_file("esso-vectwin") is None and parameters.published_file("") is None
    )
    own = tmp_path / "own.toml"
    assert parameters.published_file(str(own)) is None
    (tmp_path / "own.mmg.toml").write_text("", encoding="utf-8")
    assert parameters.published_file(str(own)) == tmp_path / "own.mmg.toml"
