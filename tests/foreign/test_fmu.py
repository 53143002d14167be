"""FMUs that are built here: mapped, stepped, and what is wrong with one is said with its second."""

import fmus
import numpy as np
import pytest
import tanker

pytest.importorskip("fmpy", reason="FMPy is not installed: pip install 'shiplog[fmu]'")

from shiplog.foreign import mapping
from shiplog.foreign.callables import Refused
from shiplog.foreign.exchange import ExchangeFmu
from shiplog.foreign.fmu import Fmu
from shiplog.foreign.fmu_file import description
from shiplog.foreign.mapping import Description
from shiplog.foreign.rows import apparent
from shiplog.foreign.source import SimulatorError
from shiplog.foreign.trying import slopes
from shiplog.ship_profile import file as profiles
from shiplog.ship_profile.unchecked_lines import unchecked_lines

SHIP = profiles.load("esso-vectwin")


def rows(count=6):
    rng = np.random.default_rng(4)
    state = rng.normal(size=(count, 6)) * (5.0, 0.2, 5.0, 0.1, 2.0, 0.05)
    state[:, 1] += 0.6
    acts = rng.uniform((-0.4, -0.4, 4.0), (0.4, 0.4, 10.0), (count, 3))
    return np.concatenate((state, acts, rng.normal(size=(count, 2)), np.zeros((count, 1))), 1)


def opened(folder, **given):
    path = fmus.build(folder / "tanker.fmu", **given)
    told = Description.from_record(description(path))
    draft = folder / "tanker.toml"
    draft.write_text(mapping.draft(told, SHIP), "utf-8")
    assert not unchecked_lines(draft.read_text("utf-8"))
    mapped = mapping.load(draft, told, SHIP, False)
    return (ExchangeFmu if told.exchange else Fmu)(path, mapped)


@pytest.mark.parametrize("version", [2, 3])
def test_an_fmu_gives_the_accelerations_of_its_equations(tmp_path, version):
    """Of knots, degrees and rpm, with the wind over ground: as `tanker.py` in SI and apparent."""
    of = opened(tmp_path, version=version)
    facts = of.probe(rows(12))
    assert (facts["random"], facts["place"], facts["sound"]) == (0.0, 0.0, 1.0)
    found, troubles = of.rates(rows())
    wind = apparent(rows())
    expected = [tanker.f(r[:6], (*r[6:9], *w), 0.0) for r, w in zip(rows(), wind, strict=True)]
    scale = np.abs(found).max(0)
    assert (found - np.array(expected)[:, [1, 3, 5]]) / scale == pytest.approx(0.0, abs=2e-3)
    assert not troubles


def test_a_window_goes_as_the_equations_do(tmp_path):
    """Against Runge and Kutta's rule on `tanker.py`, with the same inputs held."""
    of, (row,) = opened(tmp_path), rows(1)
    driven = np.tile(row[6:-1], (1, 11, 1))
    states, troubles = of.roll(row[None, :6], driven, np.ones((1, 10)), np.array([7.0]))
    assert not troubles
    x, h = row[:6], 0.1

    def rate(x):
        wind = apparent(np.concatenate((x, row[6:]))[None])[0]
        return tanker.f(x, (*row[6:9], *wind), 0.0)

    for _ in range(100):
        k1 = rate(x)
        k2 = rate(x + 0.5 * h * k1)
        k3 = rate(x + 0.5 * h * k2)
        x = x + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + rate(x + h * k3))
    assert states[0, -1] == pytest.approx(x, abs=1e-6)


def test_model_exchange_gives_its_own_derivatives(tmp_path):
    """ν̇ without a step, and ∂ν̇ by directional derivatives of knots, degrees and rpm."""
    of = opened(tmp_path, exchange=True)
    facts = of.probe(rows(12))
    assert (facts["returns"], facts["differentiated"]) == ("derivative", True)
    found, troubles = of.rates(rows())
    wind = apparent(rows())
    expected = [tanker.f(r[:6], (*r[6:9], *w), 0.0) for r, w in zip(rows(), wind, strict=True)]
    assert found == pytest.approx(np.array(expected)[:, [1, 3, 5]], rel=1e-9, abs=1e-12)
    assert not troubles
    (_, by), _ = slopes(PlainRates(of), rows(), np.full(11, 1e-5))
    assert of.exact(rows()) == pytest.approx(by, abs=1e-6)


def test_a_window_of_model_exchange_is_that_of_co_simulation(tmp_path):
    row = rows(1)[0]
    driven = np.tile(row[6:-1], (1, 11, 1))
    given = (row[None, :6], driven, np.ones((1, 10)), np.zeros(1))
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    one, _ = opened(tmp_path / "a", exchange=True).roll(*given)
    other, _ = opened(tmp_path / "b").roll(*given)
    assert one == pytest.approx(other, abs=2e-3)


class PlainRates:
    """Of an FMU, without derivatives of its own."""

    def __init__(self, of):
        self.rates, self.roll = of.rates, of.roll

    def exact(self, rows):
        return None


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"REFUSE": 5}, "refused the step of 0.1 s (discard)"),
        ({"BLANK": 5}, "gave what is no finite number"),
        ({"RESTART": 5, "time": True}, "has the time 0 s after a step to"),
    ],
    ids=["refuses", "blank", "restarts"],
)
def test_what_fails_is_said_with_its_second(tmp_path, wrong, words):
    of = opened(tmp_path, **wrong)
    driven = np.tile(rows(1)[0, 6:-1], (2, 11, 1))
    driven[1, 1:] = driven[1, :1]
    states, troubles = of.roll(rows(2)[:, :6], driven, np.ones((2, 10)), np.array([100.0, 300.0]))
    assert [one.row for one in troubles] == [0, 1]
    assert all(one.words.startswith(words) for one in troubles)
    assert [one.second for one in troubles] == pytest.approx([105.0, 305.0], abs=0.1 + 1e-6)
    assert np.isfinite(states[:, :5]).all() and np.isnan(states[:, 6:]).all()
    found, _ = of.rates(rows())  # it goes on with another start
    assert np.isfinite(found).all()


def test_what_is_not_mapped_is_asked_for(tmp_path):
    names = [("speed", "kn"), *fmus.OUTPUTS[1:]]
    path = fmus.build(
        tmp_path / "odd.fmu", outputs=[("x", "m"), *names[1:]], inputs=fmus.INPUTS[1:]
    )
    told = Description.from_record(description(path))
    text = mapping.draft(told, SHIP)
    assert "inputs.rudder_port.variable" in unchecked_lines(text)
    file = tmp_path / "odd.toml"
    file.write_text(text, "utf-8")
    with pytest.raises(SimulatorError, match="still says CHECK"):
        mapping.load(file, told, SHIP, False)
    with pytest.raises(SimulatorError, match=r"inputs\.rudder_port is empty"):
        mapping.load(file, told, SHIP, True)
    file.write_text(text.replace('variable = ""', 'variable = "-"'), "utf-8")
    assert mapping.load(file, told, SHIP, True)["ignored"] == ["rudder_port"]


@pytest.mark.parametrize(
    ("was", "now", "words"),
    [
        ('unit = "kn"', 'unit = "deg"', "state.surge.unit is 'deg', which is no speed"),
        ('unit = "rpm"', 'unit = "furlong"', "inputs.propeller.unit is 'furlong'"),
        ('output = "u"', 'output = "uu"', "no such variable"),
        ('start = "u_start"', 'start = "-"', "what a window begins with"),
        ("step_s = 0.1", "step_s = 50.0", "step_s is 50"),
        ("[inputs.propeller]", "[inputs.sail]", "inputs.propeller is empty"),
    ],
)
def test_a_wrong_mapping_is_refused(tmp_path, was, now, words):
    path = fmus.build(tmp_path / "tanker.fmu")
    told = Description.from_record(description(path))
    text = mapping.draft(told, SHIP)
    assert was in text
    file = tmp_path / "tanker.toml"
    file.write_text(text.replace(was, now, 1), "utf-8")
    with pytest.raises(SimulatorError) as error:
        mapping.load(file, told, SHIP, False)
    assert words in str(error.value)


def test_what_is_no_fmu_is_refused(tmp_path):
    path = tmp_path / "text.fmu"
    path.write_text("no archive")
    with pytest.raises(Refused, match="cannot be read"):
        description(path)


def test_an_fmu_that_is_no_ship_is_refused(tmp_path):
    """Its surge does not move: mapped to a parameter."""
    path = fmus.build(tmp_path / "tanker.fmu")
    told = Description.from_record(description(path))
    text = mapping.draft(told, SHIP)
    for name in ("u", "v", "r"):
        text = text.replace(f'output = "{name}"', f'output = "{name}_start"')
    file = tmp_path / "tanker.toml"
    file.write_text(text, "utf-8")
    with pytest.raises(Refused, match="it is no ship"):
        Fmu(path, mapping.load(file, told, SHIP, False)).probe(rows())


@pytest.mark.parametrize("exchange", [False, True])
def test_a_yaw_rate_in_another_unit_is_refused(tmp_path, exchange):
    """The FMU's yaw rate is in rad/s; a mapping that says deg/s has a heading that turns faster."""
    path = fmus.build(tmp_path / "tanker.fmu", exchange=exchange)
    told = Description.from_record(description(path))
    text = mapping.draft(told, SHIP).replace('unit = "rad/s"', 'unit = "deg/s"')
    file = tmp_path / "tanker.toml"
    file.write_text(text, "utf-8")
    mapped = mapping.load(file, told, SHIP, False)
    with pytest.raises(Refused, match="its heading does not turn with its yaw rate"):
        (ExchangeFmu if exchange else Fmu)(path, mapped).probe(rows(9))


def test_names_are_inert_in_a_draft():
    told = Description("a.fmu", "2.0", "", 0.1, (
        mapping.Variable('u"\n[x]', "output", False, "real", "m/s", "CHECK\n\x1b[2J"),
        mapping.Variable("u", "output", False, "real", "m/s", 'a\n"b" # CHECK'),
    ))  # fmt: skip
    text = mapping.draft(told, SHIP)
    assert "\x1b" not in text and "[x]" not in [line.strip() for line in text.splitlines()]
    assert "state.surge.output" not in unchecked_lines(text)
