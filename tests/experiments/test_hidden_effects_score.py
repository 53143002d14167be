"""The scorer of the blind test, against verdicts and keys made by hand; the runner, with stubs."""

import hashlib
import json
import math
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pipelines.experiments.hidden_effects import (
    oracle,
    parameters,
    plan,
    run,
    score,
    score_tables,
    suites,
)
from pipelines.experiments.hidden_effects.__main__ import main
from pipelines.experiments.hidden_effects.parameters import compare
from pipelines.experiments.hidden_effects.plan import Plan, Planned
from pipelines.experiments.hidden_effects.score import Answer, Sealed, calibration, open_key
from pipelines.experiments.simulated_ship.cases import CATALOGUE, OUTSIDE, draw
from shiplog import profile_file as profiles
from shiplog.models.causes import Setting

ROOT = Path(__file__).parents[2]


def hidden(**causes):
    """A key: name → (size, parameters); `family` for what is outside."""
    family = causes.pop("family", None)
    reported = [{"name": n, "size": s, "parameters": given(**p)} for n, (s, p) in causes.items()]
    verdict = "unknown" if family else "named" if reported else "none"
    structure = {"family": family} if family else None
    return {"contract": 1, "verdict": verdict, "causes": reported, "structure": structure}


def given(**parameters):
    """Values with units, and 90 % intervals where there are four of them."""
    names = ("value", "unit", "low", "high")
    return {k: dict(zip(names, v, strict=False)) for k, v in parameters.items()}


def named(*names, **more):
    causes = [{"name": name, "probability": 0.95, "parameters": {}} for name in names]
    return {"contract": 1, "verdict": "named", "causes": causes} | more


NONE = {"contract": 1, "verdict": "none", "causes": [], "ranking": [], "structure": None}
CURRENT = hidden(current=(1.0, {"speed": (0.1, "m/s"), "direction": (90.0, "deg")}))
STEPS = [{"step": "diagnose", "rc": 0, "wall_s": 9.0, "cpu_s": 7.5, "peak_mb": 800.0}]


def answer(key, verdict, seconds=7000, seed=1):
    return Answer(Planned(str(seed), seed, None, None, seconds), verdict, key, STEPS)


def measured(answers):
    """First column of the goals' table → the others."""
    return {row[0]: row[1:] for row in score_tables.goals(answers)}


# --- what is right --------------------------------------------------------------------------------

BOTH = hidden(current=(1.0, {}), fouling=(1.0, {}))
TETHER = hidden(tether=(1.0, {}), family="position")
UNKNOWN = {"contract": 1, "verdict": "unknown", "causes": [], "structure": {"family": "position"}}


@pytest.mark.parametrize(
    ("key", "verdict", "right", "misnamed"),
    [
        (CURRENT, named("current"), True, False),
        (CURRENT, named("fouling"), False, True),
        (CURRENT, named("current", "fouling"), False, True),
        (CURRENT, NONE, False, False),
        (CURRENT, UNKNOWN, False, False),
        (CURRENT, {"verdict": "failed", "step": "diagnose", "rc": 1}, False, False),
        (hidden(), NONE, True, False),
        (hidden(), named("current"), False, True),
        (hidden(), {"verdict": "coverage", "causes": [{"name": "coverage"}]}, False, False),
        (TETHER, UNKNOWN, True, False),
        (TETHER, UNKNOWN | {"structure": {"family": "controls"}}, False, False),
        (TETHER, UNKNOWN | {"structure": None}, False, False),
        (TETHER, named("current"), False, True),
        (BOTH, named("fouling", "current"), True, False),
        (BOTH, named("current"), False, False),
        (BOTH, named("current", "fouling", "payload"), False, True),
        (hidden(clock_offset=(1.0, {})), named("clock_offset:wind"), True, False),
    ],
)
def test_all_of_it_and_nothing_else_is_right(key, verdict, right, misnamed):
    one = answer(key, verdict)
    assert (one.right, one.misnamed) == (right, misnamed)


def test_the_goals_table_counts_by_hand():
    answers = [
        *[answer(CURRENT, named("current"))] * 19,
        answer(CURRENT, named("payload"), seed=7),
        answer(hidden(current=(0.3, {})), NONE),
        answer(hidden(current=(0.1, {})), NONE),
        answer(CURRENT, named("current"), seconds=500),
        *[answer(hidden(), NONE)] * 3,
        answer(hidden(), UNKNOWN),
        answer(hidden(), {"verdict": "failed"}),
        answer(TETHER, UNKNOWN),
        answer(BOTH, named("current")),
        answer(BOTH, named("current", "fouling")),
    ]
    rows = measured(answers)
    assert rows["one cause, size 1, 7000 s: named right"] == (
        "95 %", "19/20", "78.4 % to 99.7 %", ">= 96 %", "no"
    )  # fmt: skip
    counts = {
        "one cause, size 0.3 to 1, 7000 s": ("0/1", "no"),
        "one cause, size below 0.3, 7000 s": ("0/1", ""),
        "one cause, size 1, 500 s": ("1/1", "yes"),
        "nothing hidden: a cause named": ("0/5", ""),
        "nothing hidden: any alarm": ("2/5", "no"),  # what failed did not say `none`
        "named but wrong, any size": ("1/31", "no"),
        "outside, size 1: unknown or undecided, right family": ("1/1", "yes"),
        "two at once, size 1: both, no third": ("1/2", "no"),
    }
    assert {what: (rows[what][1], rows[what][-1]) for what in counts} == counts
    assert rows["held-out gain over the oracle's: median"][0] == "not measured"
    assert rows["diagnose 7000 s, mmg: CPU time, median (worst)"][0] == "7.5 s (7.5 s)"
    assert rows["diagnose 7000 s, mmg: peak memory, median (worst)"][0] == "800 MB (800 MB)"
    assert "outside, size below 1" not in rows


def test_a_network_that_learned_the_trial_has_goals_of_its_own():
    """A current it cannot absorb, thrust it can: naming that is wrong, silence is right."""

    def learned(key, verdict):
        planned = Planned("1", 1, None, 1.0, 7000, "feedforward")
        return replace(answer(key, verdict), planned=planned)

    lost = hidden(thrust_loss=(1.0, {}))
    rows = measured([
        learned(CURRENT, named("current")), learned(CURRENT, NONE), learned(lost, NONE),
        learned(lost, named("thrust_loss")), learned(lost, named("current")),
    ])  # fmt: skip
    sure = [{"name": "none", "probability": 0.6}]
    silent = learned(lost, NONE | {"ranking": sure})
    assert silent.right and silent.belief == (0.6, True)
    assert not learned(CURRENT, NONE | {"ranking": sure}).right
    assert not answer(lost, NONE).right and not learned(lost, named("current")).right
    of = "network on affected data: "
    assert rows[f"{of}what it cannot take in"][1] == "1/2"
    assert rows[f"{of}what it has taken in, named"][1] == "1/3"
    assert rows[f"{of}named but wrong"][1] == "1/5"
    assert "one cause, size 1, 7000 s: named right" not in rows
    assert "named but wrong, any size" not in rows
    assert rows["diagnose 7000 s, feedforward: CPU time, median (worst)"][3] == "<= 60 s"


def test_the_gain_is_set_against_the_oracles_where_there_is_one():
    """None where nothing is named, the truth itself gains nothing, or nobody asked."""
    better = [named("current", gain={"reduction": r}) for r in (0.6, 0.8, 0.76)]
    estimated = [replace(answer(CURRENT, verdict), oracle=0.8) for verdict in (*better, NONE)]
    gyro = replace(answer(CURRENT, better[0]), oracle=0.01)
    rows = measured([*estimated, gyro, answer(CURRENT, better[0])])
    assert rows["held-out gain over the oracle's: median"][:2] == ("95 %", "3")
    assert rows["held-out gain over the oracle's: worst tenth"][:2] == ("75 %", "3")


def test_the_truth_in_the_catalogues_own_numbers():
    """Told as the contract has it, the numbers show just that again."""
    profile = profiles.load("esso-vectwin")
    scale = {"speed": 0.6, "length": 3.0, "mass": 244.6, "moment": 733.8}
    setting = Setting(profile, scale, np.zeros((12, 2)), 1.0)

    def numbers_of(name, **estimated):
        parameters = {k: {"value": v} for k, v in estimated.items()}
        return oracle.true_cause({"name": name, "parameters": parameters}, setting)

    for towards, want in (
        (190.0, [-0.0985, -0.0174]), (10.0, [0.0985, 0.0174]), (280.0, [0.0174, -0.0985]),
    ):  # fmt: skip
        cause, numbers = numbers_of("current", speed=0.1, direction=towards)
        assert cause.label == "current" and numbers == pytest.approx(want, abs=1e-4)
    _, numbers = numbers_of("payload", mass=30.0, position=-0.5)
    assert numbers == pytest.approx([30.0, -15.0], rel=1e-6)
    cause, numbers = numbers_of("clock_offset", time=0.4, channel="velocity")
    assert cause.label == "clock_offset:velocity" and numbers == pytest.approx([0.4])
    _, numbers = numbers_of("rudder_offset", port=-2.0, starboard=0.0)
    assert numbers == pytest.approx([-math.radians(2.0), 0.0], abs=1e-9)
    for name in ("bank", "side_thrust", "propeller_walk"):
        assert numbers_of(name) is None


# --- parameters -----------------------------------------------------------------------------------


def test_a_current_is_compared_as_a_vector_across_north():
    """0.1 m/s towards 359 and 1 deg: 2 · 0.1 · sin 1° apart."""
    truth = given(speed=(0.1, "m/s"), direction=(359.0, "deg"))
    reported = given(speed=(0.1, "m/s", 0.09, 0.11), direction=(1.0, "deg", -2.0, 4.0))
    one = compare("current", truth, reported)
    assert one.error == pytest.approx(2.0 * math.sin(math.radians(1.0)))
    assert one.covered == (True, True)
    for low, high in ((358.0, 362.0), (-2.0, 0.0), (718.0, 724.0)):
        near = reported | given(direction=(1.0, "deg", low, high))
        assert compare("current", truth, near).covered == (True, True)
    for low, high in ((0.0, 2.0), (360.0, 362.0)):
        off = reported | given(direction=(1.0, "deg", low, high))
        assert compare("current", truth, off).covered == (True, False)


@pytest.mark.parametrize(
    ("name", "truth", "reported", "error"),
    [
        ("heading_offset", {"angle": (-4.0, "deg")}, {"angle": (355.0, "deg")}, 0.25),
        ("wind_direction_offset", {"angle": (20.0, "deg")}, {"angle": (21.0, "deg")}, 0.05),
        ("fouling", {"factor": (1.3, "1")}, {"factor": (1.27, "1")}, 0.1),
        ("thrust_loss", {"factor": (0.8, "1")}, {"factor": (0.9, "1")}, 0.5),
        ("thrust_drift", {"slope": (-0.2, "1")}, {"slope": (-0.25, "1")}, 0.25),
        ("yaw_rate_scale", {"value": (1.05, "1")}, {"value": (1.04, "1")}, 0.2),
        ("yaw_rate_bias", {"value": (0.4, "deg/s")}, {"value": (0.3, "deg/s")}, 0.25),
        ("rudder_lag", {"time": (2.0, "s")}, {"time": (1.9, "s")}, 0.05),
        (
            "wind_force",
            {"surge_factor": (1.3, "1"), "sway_factor": (1.4, "1"), "yaw_factor": (1.0, "1")},
            {"surge_factor": (1.3, "1"), "sway_factor": (1.4, "1"), "yaw_factor": (0.9, "1")},
            0.2,
        ),
        (
            "antenna_offset",
            {"x": (0.3, "m"), "y": (-0.4, "m")},
            {"x": (0.3, "m"), "y": (-0.35, "m")},
            0.1,
        ),
        ("rudder_offset", {"port": (4.0, "deg"), "starboard": (0.0, "deg")},
         {"port": (4.0, "deg"), "starboard": (1.0, "deg")}, 0.25),
        ("rudder_offset", {"port": (3.0, "deg"), "starboard": (4.0, "deg")},
         {"port": (3.0, "deg")}, 0.8),
        # 40 kg at 0.75 m: 40 and 30, together 50; 5 kg too much at 2/3 m is 5 and 0 off
        ("payload", {"mass": (40.0, "kg"), "position": (0.75, "m")},
         {"mass": (45.0, "kg"), "position": (2 / 3, "m")}, 0.1),
        ("clock_offset", {"time": (0.5, "s"), "channel": ("wind", "")},
         {"time": (0.6, "s"), "channel": ("wind", "")}, 0.2),
        ("clock_offset", {"time": (0.5, "s"), "channel": ("gnss", "")},
         {"time": (0.5, "s"), "channel": ("position", "")}, math.sqrt(0.5)),
        ("shallow_water", {"strength": (0.8, "1"), "length": (5.0, "m")},
         {"strength": (0.6, "1")}, 0.25),
        ("side_thrust", {"force": (4.0, "N")}, {}, None),
    ],
)  # fmt: skip
def test_errors_are_relative_to_what_was_added(name, truth, reported, error):
    found = compare(name, given(**truth), given(**reported)).error
    assert found is None if error is None else found == pytest.approx(error)


def test_a_channel_may_be_bare_and_the_wrong_one_covers_nothing():
    truth = given(time=(0.5, "s"), channel=("gnss", ""))
    reported = given(time=(0.5, "s", 0.4, 0.6))
    assert compare("clock_offset", truth, reported | {"channel": "gnss"}).covered == (True,)
    assert compare("clock_offset", truth, reported | {"channel": "wind"}).covered == (False,)


def test_medians_and_coverage_are_of_named_causes_by_group():
    """Errors of 1, 2 and 9 % have the median 2 %; three of four intervals contain the truth."""

    def lag(time, low, high):
        verdict = named("rudder_lag")
        verdict["causes"][0]["parameters"] = given(time=(time, "s", low, high))
        return answer(hidden(rudder_lag=(1.0, {"time": (2.0, "s")})), verdict)

    fouled = named("fouling")
    fouled["causes"][0]["parameters"] = given(factor=(1.3, "1", 1.2, 1.35))
    key = hidden(fouling=(1.0, {"factor": (1.25, "1")}))
    unnamed = answer(key, named("payload"))
    answers = [
        lag(2.02, 1.9, 2.1), lag(1.96, 1.9, 2.0), lag(2.18, 2.1, 2.3), answer(key, fouled), unnamed
    ]  # fmt: skip
    rows = measured(answers)
    what = "parameters, size 1, 7000 s: "
    row = rows[what + "zeros, clocks, current, median error"]
    assert row == ("2 %", "3", "", "<= 3 %", "yes")
    assert rows[what + "rest, median error"][:2] == ("20 %", "1")
    covered = rows[what + "90 % intervals that hold the truth"]
    assert (covered[0], covered[1], *covered[3:]) == ("75 %", "3/4", ">= 85 % and <= 95 %", "no")
    assert answer(key, named("payload")).compared == {}


# --- probabilities --------------------------------------------------------------------------------


def test_calibration_of_ten_bins_by_hand():
    """|0.95 - 1/2| weighs 2 of 4, |0.6 - 1| and |0.05 - 0| weigh 1 of 4 each."""
    reported = [(0.95, True), (0.95, False), (0.6, True), (0.05, False)]
    assert calibration(reported) == pytest.approx(0.5 * 0.45 + 0.25 * 0.4 + 0.25 * 0.05)
    assert calibration([(1.0, True)]) == 0.0


@pytest.mark.parametrize(
    ("key", "verdict", "belief"),
    [
        (CURRENT, named("current", "fouling"), (0.95, True)),
        (CURRENT, named("fouling"), (0.95, False)),
        (CURRENT, NONE | {"ranking": [{"name": "none", "probability": 0.6}]}, (0.6, False)),
        (hidden(), NONE | {"ranking": [{"name": "none", "probability": 0.6}]}, (0.6, True)),
        (hidden(), NONE | {"ranking": [{"name": "bank", "probability": 0.4}]}, (0.4, False)),
        (
            TETHER,
            UNKNOWN | {"ranking": [{"name": "unknown:position", "probability": 1}]},
            (1.0, True),
        ),
        (hidden(), NONE, None),
        (hidden(), {"verdict": "failed"}, None),
    ],
)
def test_the_probability_is_that_of_the_answer(key, verdict, belief):
    assert answer(key, verdict).belief == belief


# --- mistakes -------------------------------------------------------------------------------------


def test_a_mistake_says_what_and_how_to_make_it_again():
    planned = Planned("20017-2", 20017, "rudder_lag", 0.3, 7000)
    verdict = named("thrust_loss", margin=4.06)
    verdict["causes"][0]["indistinguishable_from"] = ["fouling"]
    wrong = Answer(planned, verdict, hidden(rudder_lag=(0.3, {})), STEPS)
    line = score_tables.mistakes([wrong, answer(CURRENT, named("current"))]).splitlines()[2:]
    assert len(line) == 1
    cells = [cell.strip() for cell in line[0].strip("|").split("|")]
    assert cells == [
        "20017-2", "rudder_lag x0.3", "named thrust_loss or fouling", "4.1",
        "20017 LOGS --key KEY --cause rudder_lag --size 0.3 --seconds 7000",
    ]  # fmt: skip
    assert score_tables.mistakes([answer(CURRENT, named("current"))]) == "Nothing was mistaken."
    table = score_tables.per_cause([wrong, answer(CURRENT, named("current"))])
    assert "| current    | 1/1    |" in table and "| rudder_lag |        | 0/1" in table


# --- the seal -------------------------------------------------------------------------------------


def test_no_key_is_opened_before_the_verdict_is_sealed(tmp_path):
    """There is no key here at all: whoever tried to open it would raise something else."""
    verdict, key = tmp_path / "verdict.json", tmp_path / "key.json"
    with pytest.raises(Sealed, match="is not opened"):
        open_key(tmp_path, key)
    verdict.write_text(json.dumps(NONE))
    with pytest.raises(Sealed, match="is not opened"):
        open_key(tmp_path, key)
    seal = hashlib.sha256(verdict.read_bytes()).hexdigest()
    (tmp_path / "verdict.sha256").write_text(f"{seal}  verdict.json\n")
    verdict.write_text(json.dumps(named("current")))
    with pytest.raises(Sealed, match="not what was sealed"):
        open_key(tmp_path, key)
    (tmp_path / "verdict.sha256").write_text("")
    with pytest.raises(Sealed, match="not what was sealed"):
        open_key(tmp_path, key)
    verdict.write_text(json.dumps(NONE))
    (tmp_path / "verdict.sha256").write_text(f"{seal}  verdict.json\n")
    key.write_text(json.dumps(hidden()))
    assert open_key(tmp_path, key) == (NONE, hidden())


def test_the_scorer_knows_nothing_of_the_simulator():
    program = (
        "import sys; from pipelines.experiments.hidden_effects import score, score_tables; "
        "simulator = 'pipelines.experiments.simulated_ship'; "
        "sys.exit(any(name.startswith(simulator) for name in sys.modules))"
    )
    assert subprocess.run([sys.executable, "-c", program], cwd=ROOT, check=False).returncode == 0


# --- suites ---------------------------------------------------------------------------------------


def test_every_cause_is_met_equally_often_and_rows_share_their_ships():
    goals = suites.plan("goals", 20000, 42)
    rows = [[p for p in goals.cases if p.label.endswith(f"-{row}")] for row in range(1, 7)]
    ones = [p.cause for p in rows[0]]
    assert sorted(ones[:21]) == sorted(ones[21:]) == sorted(CATALOGUE)
    assert [p.cause for p in rows[1]] == ones == [p.cause for p in rows[2]]
    assert [p.cause for p in rows[4]] == [*OUTSIDE] * 10 + [*OUTSIDE][:2]
    assert {p.cause for p in rows[3]} == {"none"}
    assert [{p.size for p in row} for row in rows] == [{1.0}, {0.3}, {1.0}, {None}, {1.0}, {1.0}]
    assert [{p.seconds for p in row} for row in rows] == [{7000}] * 2 + [{500}] + [{7000}] * 3
    assert all([p.seed for p in row] == [*range(20000, 20042)] for row in rows)
    pairs = [draw(p.seed, cause=p.cause, size=1.0).causes for p in rows[5]]
    assert all(len({cause.name for cause in pair}) == 2 for pair in pairs)
    assert len({p.cause for p in rows[5]}) > 30
    assert suites.plan("goals", 20000, 21).cases == goals.cases[: 21 * 6]


def test_the_fixed_suite_hides_something_of_every_kind():
    fixed = suites.plan("fixed")
    drawn = [draw(p.seed) for p in fixed.cases]
    assert len(drawn) == 12
    assert {case.verdict for case in drawn} == {"none", "named", "unknown"}
    assert {len(case.causes) for case in drawn} == {0, 1, 2}
    assert [p.seed for p in suites.plan("brief").cases] == [p.seed for p in fixed.cases]
    assert {(p.seconds, p.size) for p in suites.plan("brief").cases} == {(3000, 1.0)}
    assert len(suites.plan("nightly", 7).cases) == 200
    network = suites.plan("network")
    assert {p.cause for p in network.cases} == {*parameters.SURVIVE, *parameters.ABSORBED}
    assert {p.model for p in network.cases} == {"feedforward"}


def test_a_plan_may_grow_but_not_change(tmp_path):
    small, large = suites.plan("nightly", 5, 2), suites.plan("nightly", 5, 3)
    assert plan.save(tmp_path, small) == small
    assert plan.save(tmp_path, large) == plan.load(tmp_path) == large
    assert plan.save(tmp_path, small) == large
    with pytest.raises(plan.ShiplogError, match="holds nightly from seed 5"):
        plan.save(tmp_path, suites.plan("nightly", 6, 3))
    other = Plan("nightly", 5, (Planned("5", 5, "current", 1.0, 7000),))
    with pytest.raises(plan.ShiplogError, match="Case 5 "):
        plan.save(tmp_path, other)
    with pytest.raises(plan.ShiplogError, match="no test"):
        plan.load(tmp_path / "elsewhere")


# --- the runner, with a simulator and a shiplog that do nothing -----------------------------------

SIMULATOR = """
import json, pathlib, sys
seed, logs, _, key, *options = sys.argv[1:]
logs, key = pathlib.Path(logs), pathlib.Path(key)
logs.mkdir(); key.parent.mkdir(exist_ok=True)
for name in ("nominal_1", "trial_1"):
    (logs / f"{name}.mcap").write_text(name + seed)
cause = {"name": "current", "size": 1.0, "parameters": {}}
key.write_text(json.dumps({"verdict": "named", "causes": [cause], "structure": None}))
"""
SHIPLOG = """
import json, os, pathlib, sys
command, first, *options = sys.argv[1:]
given = {k: v for k, v in zip(options, options[1:])}
assert os.environ["OMP_NUM_THREADS"] == "1"
with open(os.environ["SAID"], "a") as reported:
    print(command, "keys" in " ".join(sys.argv), file=reported)
print("words on stderr", file=sys.stderr)
if command == "ingest":
    found = sorted(p.name for p in pathlib.Path(first).iterdir())
    assert found == ["nominal_1.mcap", "trial_1.mcap"]
    pathlib.Path(given["--store"]).mkdir()
elif command == "train":
    pathlib.Path(given["--out"]).mkdir()
else:
    assert pathlib.Path(first).is_dir()
    if os.environ.get("BREAK") in first:
        sys.exit(1)
    cause = {"name": "current", "probability": 0.9, "parameters": {}}
    pathlib.Path(given["--json"]).write_text(json.dumps({"verdict": "named", "causes": [cause]}))
"""


@pytest.fixture
def stubs(tmp_path, monkeypatch):
    monkeypatch.setenv("SAID", str(tmp_path / "said"))
    monkeypatch.setenv("BREAK", "nothing")
    for name, program in (("simulator", SIMULATOR), ("shiplog", SHIPLOG)):
        (tmp_path / f"{name}.py").write_text(program)
    commands = {
        "case": (sys.executable, str(tmp_path / "simulator.py")),
        "shiplog": (sys.executable, str(tmp_path / "shiplog.py")),
    }
    return lambda **more: run.Settings(**commands, **more)


def commands_said(tmp_path):
    lines = (tmp_path / "said").read_text().splitlines()
    assert not any(line.endswith("True") for line in lines)  # no step of shiplog is shown the keys
    return [line.split()[0] for line in lines]


def test_a_case_goes_the_whole_way_once(tmp_path, stubs):
    out = tmp_path / "out"
    planned = plan.save(out, suites.plan("nightly", 5, 2))
    run.run(out, planned, stubs(jobs=2))
    folder = out / "cases" / "5"
    kept = {"verdict.json", "verdict.sha256", "steps.json"}
    assert {p.name for p in folder.iterdir()} == kept
    steps = json.loads((folder / "steps.json").read_text())
    assert [step["step"] for step in steps] == ["logs", "ingest", "train", "diagnose"]
    assert all(step["wall_s"] > 0 and step["cpu_s"] > 0 for step in steps)
    # no upper bound: a forked child's peak begins at its parent's, here the whole test session's
    assert steps[-1]["peak_mb"] > 1.0
    assert steps[-1]["stderr"] == "words on stderr\n"

    run.run(out, planned, stubs())
    assert sorted(commands_said(tmp_path)) == ["diagnose"] * 2 + ["ingest"] * 2 + ["train"] * 2
    found = score.read(out)
    assert [one.right for one in found.answers] == [True, True] and not found.pending
    assert "2/2" in score_tables.text(found)
    (folder / "verdict.json").write_text(json.dumps(NONE))
    with pytest.raises(Sealed):
        score.read(out)


def test_a_diagnosis_that_breaks_is_a_wrong_answer_and_is_tried_again(
    tmp_path, stubs, monkeypatch, capsys
):
    out = tmp_path / "out"
    planned = plan.save(out, suites.plan("nightly", 5, 2))
    monkeypatch.setenv("BREAK", "cases/6")
    run.run(out, planned, stubs())
    assert main(["score", str(out)]) == 3
    assert "failed: diagnose ended with 1" in capsys.readouterr().out
    assert [one.word for one in score.read(out).answers] == ["named", "failed"]
    monkeypatch.setenv("BREAK", "nothing")
    run.run(out, planned, stubs())
    assert commands_said(tmp_path).count("diagnose") == 3
    assert main(["score", str(out)]) == 0
    assert main(["score", str(out), "--least", "2"]) == 0
    assert main(["score", str(out), "--least", "3"]) == 4
    assert "2 right and 0 misnamed" in capsys.readouterr().out


def test_one_wrong_name_is_too_many(tmp_path, stubs, capsys):
    """However many are right next to it."""
    out = tmp_path / "out"
    run.run(out, plan.save(out, suites.plan("nightly", 5, 2)), stubs())
    key = out / "keys" / "6.json"
    key.write_text(key.read_text().replace("current", "bank"))
    assert main(["score", str(out), "--least", "1"]) == 4
    assert "1 right and 1 misnamed" in capsys.readouterr().out


def test_a_ship_is_trained_once_where_that_is_asked_for(tmp_path, stubs):
    out = tmp_path / "out"
    run.run(out, plan.save(out, suites.plan("goals", 5, 1)), stubs(share=True, keep=True))
    reported = commands_said(tmp_path)
    assert (reported.count("train"), reported.count("diagnose")) == (1, 6)
    assert (out / "cases" / "5-1" / "logs" / "trial_1.mcap").exists()


def test_what_has_not_run_is_pending_and_what_could_not_be_made_is_reported(tmp_path, stubs):
    out = tmp_path / "out"
    plan.save(out, suites.plan("nightly", 5, 2))
    assert len(score.read(out).pending) == 2
    assert score_tables.text(score.read(out)) == "nightly: 0 of 2 cases scored; 2 not run yet."
    (tmp_path / "simulator.py").write_text("raise SystemExit(1)")
    run.run(out, plan.load(out), stubs())
    found = score.read(out)
    assert len(found.unmade) == 2 and not found.answers
    assert json.loads((out / "cases" / "5" / "verdict.json").read_text())["step"] == "logs"
