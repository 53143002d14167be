"""Blind cases: what is drawn, how often and how large, and no trace of it with the logs."""

import ast
import json
import math
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from simulated_voyages import START, STEADY

from pipelines.experiments import simulated_ship
from pipelines.experiments.simulated_ship import (
    BANK_EAST,
    Ship,
    cases,
    sail,
)
from pipelines.experiments.simulated_ship import __main__ as command
from pipelines.experiments.simulated_ship.sample_logs import PLANS
from pipelines.experiments.simulated_ship.sensors import Blemishes

REPORTED = {  # the contract's names and units
    "current": {"speed": "m/s", "direction": "deg"},
    "wind_force": {"surge_factor": "1", "sway_factor": "1", "yaw_factor": "1"},
    "shallow_water": {"strength": "1", "length": "m"}, "bank": {"strength": "1", "length": "m"},
    "fouling": {"factor": "1"}, "cross_flow_drag": {"factor": "1"}, "rudder_force": {"factor": "1"},
    "thrust_loss": {"factor": "1"}, "thrust_drift": {"slope": "1"},
    "rudder_offset": {"port": "deg", "starboard": "deg"},
    "payload": {"mass": "kg", "position": "m"},
    "rudder_lag": {"time": "s"}, "rudder_delay": {"time": "s"}, "side_thrust": {"force": "N"},
    "clock_offset": {"time": "s", "channel": ""}, "heading_offset": {"angle": "deg"},
    "wind_direction_offset": {"angle": "deg"}, "yaw_rate_bias": {"value": "deg/s"},
    "yaw_rate_scale": {"value": "1"}, "wind_speed_scale": {"value": "1"},
    "antenna_offset": {"x": "m", "y": "m"},
}  # fmt: skip


def short(case, seconds=20.0):
    """One voyage of each campaign, and a short one."""
    return replace(
        case,
        nominal=(replace(case.nominal[0], seconds=seconds),),
        trial=(replace(case.trial[-1], seconds=seconds),),
    )


@pytest.mark.long
def test_two_thousand_draws_have_the_shares_they_should():
    drawn = [cases.draw(seed) for seed in range(2000)]
    outside = sum(case.verdict == "unknown" for case in drawn)
    count = [
        sum(len(case.causes) == n and case.verdict != "unknown" for case in drawn) for n in range(3)
    ]
    for found, share in zip((*count, outside), (0.2, 0.6, 0.1, 0.1), strict=True):
        assert abs(found / 2000 - share) < 4 * math.sqrt(share * (1 - share) / 2000)
    singles = [c.causes[0] for c in drawn if c.verdict == "named" and len(c.causes) == 1]
    every = [cause for case in drawn for cause in case.causes]
    for names, known in ((singles, cases.CATALOGUE), (every, cases.CATALOGUE | cases.OUTSIDE)):
        assert {cause.name for cause in names} == set(known)
    expected = len(singles) / len(cases.CATALOGUE)
    for name in cases.CATALOGUE:
        assert abs(sum(c.name == name for c in singles) - expected) < 4.5 * math.sqrt(expected)
    logs10 = np.log10([cause.size for cause in every])
    assert logs10.min() >= -1.0 and logs10.max() <= 0.0
    assert np.histogram(logs10, 4, (-1, 0))[0] == pytest.approx(len(every) / 4, rel=0.15)
    assert all(len({c.name for c in case.causes}) == len(case.causes) for case in drawn)


@pytest.mark.parametrize("name", [*cases.CATALOGUE, *cases.OUTSIDE])
def test_every_cause_can_be_forced_at_any_size_and_reaches_only_the_trial(name):
    full, half = (cases.draw(12, cause=name, size=size) for size in (1.0, 0.5))
    none = cases.draw(12, cause="none")
    assert [c.name for c in full.causes] == [name] and none.causes == ()
    reported = full.causes[0].parameters
    assert {p: reported[p]["unit"] for p in REPORTED.get(name, {})} == REPORTED.get(name, {})
    assert full.verdict == ("named" if name in cases.CATALOGUE else "unknown")
    assert (full.ship, full.laws, full.nominal, full.trial, full.ordinary) == (
        half.ship, half.laws, half.nominal, half.trial, half.ordinary
    ) == (none.ship, none.laws, none.nominal, none.trial, none.ordinary)  # fmt: skip
    assert none.effects == none.ordinary == full.ordinary != half.effects != full.effects

    columns = []
    for case in map(short, (full, none)):
        voyage = cases.voyage(case, replace(case.trial[0], seconds=120.0))
        assert voyage.effects == case.ordinary  # not one of the case's legs: nothing hidden
        sailed = sail(
            120.0, seed=3, wind=STEADY, ship=case.ship, effects=case.effects, campaign=(0.5, 1.0)
        )
        series = simulated_ship.sensors.measure(sailed, seed=1, start=START, blemishes=Blemishes())
        columns.append([values for one in series for values in one.columns.values()])
    assert any(not np.array_equal(a, b) for a, b in zip(*columns, strict=True))


def test_the_sizes_are_those_of_the_table():
    def reported(name, seed):
        parameters = cases.draw(seed, cause=name, size=1.0).causes[0].parameters
        return [value["value"] for value in parameters.values()]

    table = {
        "current": [(0.05, 0.18), (0, 360)], "heading_offset": [(1.2, 6)], "rudder_lag": [(1.2, 5)],
        "antenna_offset": [(0.3, 1.2), (0.05, 0.3)], "rudder_delay": [(0.6, 2.0)],
        "wind_direction_offset": [(8, 25)], "yaw_rate_bias": [(0.1, 0.5)],
        "thrust_loss": [(0.70, 0.92)], "fouling": [(1.25, 2.0)], "thrust_drift": [(0.12, 0.35)],
        "payload": [(20, 55), (0, 1)], "rudder_limit": [(50, 75)], "turbulence": [(4, 9)],
        "cross_flow_drag": [(0.55, 1.45)], "tether": [(0.6, 2.0)],
    }  # fmt: skip
    for name, ranges in table.items():
        for seed in range(20):
            values = np.abs(reported(name, seed)[: len(ranges)])
            assert all(lo <= x <= hi for x, (lo, hi) in zip(values, ranges, strict=True)), name
    either = {math.copysign(1, reported("heading_offset", seed)[0]) for seed in range(20)}
    alone = {(p == 0, s == 0) for p, s in (reported("rudder_offset", seed) for seed in range(40))}
    assert either == {-1, 1} and alone == {(True, False), (False, True), (False, False)}


def test_a_case_is_logs_without_a_trace_and_a_key_elsewhere(tmp_path):
    hidden = short(cases.draw(5, cause="side_thrust+heading_offset", size=1.0), 250.0)
    plain = short(cases.draw(5, cause="none"), 250.0)
    for case, name in ((hidden, "hidden"), (hidden, "again"), (plain, "plain")):
        cases.write(case, tmp_path / name, tmp_path / "keys" / f"{name}.json")
    files = {
        name: {p.name: p.read_bytes() for p in sorted((tmp_path / name).iterdir())}
        for name in ("hidden", "again", "plain")
    }
    assert set(files["hidden"]) == {"nominal_1.mcap", "trial_6.mcap"} == set(files["plain"])
    assert files["hidden"] == files["again"]
    assert files["hidden"]["nominal_1.mcap"] == files["plain"]["nominal_1.mcap"]
    assert files["hidden"]["trial_6.mcap"] != files["plain"]["trial_6.mcap"]
    described = []
    for name in ("hidden", "plain"):
        with open(tmp_path / name / "trial_6.mcap", "rb") as stream:
            reader = make_reader(stream)
            summary = reader.get_summary()
            assert summary is not None
            channels = [(c.topic, c.metadata) for c in summary.channels.values()]
            schemas = [s.data for s in summary.schemas.values()]
            records = [(m.name, m.metadata) for m in reader.iter_metadata()]
            described.append((channels, schemas, records, list(reader.iter_attachments())))
    assert described[0] == described[1]
    assert described[0][2][0][1]["ship"] == Ship().name  # its own name would tell the seed

    key = json.loads((tmp_path / "keys" / "hidden.json").read_text())
    assert [c["name"] for c in key["causes"]] == ["side_thrust", "heading_offset"]
    assert key["verdict"] == "named" and key["affected"] == ["trial_6"]
    pulses = key["causes"][0]["parameters"]["times"]["value"]
    sailed = cases.voyage(hidden, hidden.trial[0])
    assert sailed.pulses and pulses == {"trial_6": [list(pulse) for pulse in sailed.pulses]}
    empty = json.loads((tmp_path / "keys" / "plain.json").read_text())
    assert (empty["verdict"], empty["causes"], empty["affected"]) == ("none", [], [])


def test_a_key_never_lies_with_the_logs(tmp_path):
    case = short(cases.draw(1))
    for inside in ("key.json", "deep/er/key.json", "../logs/key.json"):
        with pytest.raises(ValueError, match="elsewhere"):
            cases.write(case, tmp_path / "logs", tmp_path / "logs" / inside)
    assert not (tmp_path / "logs").exists()
    (tmp_path / "logs").mkdir()
    (tmp_path / "logs" / "mine.mcap").touch()
    with pytest.raises(FileExistsError, match=r"mine\.mcap"):
        cases.write(case, tmp_path / "logs", tmp_path / "key.json")
    for wrong in ("curent", "current+current"):
        with pytest.raises(ValueError, match=r"curent|twice"):
            cases.draw(1, cause=wrong)


def test_campaigns_are_as_long_as_asked_and_the_trial_comes_later():
    long, brief = cases.draw(6), cases.draw(6, seconds=500)
    assert [leg.seconds for leg in long.trial] == [plan.seconds for plan in PLANS]
    assert brief.nominal == long.nominal and sum(leg.seconds for leg in brief.trial) == 500.0
    short = cases.draw(6, seconds=3000)
    assert [sum(leg.seconds for leg in legs) for legs in (short.nominal, short.trial)] == (
        pytest.approx([3003.0, 3003.0])
    )
    assert (short.effects, short.ship) == (long.effects, long.ship)
    for legs in (long.nominal, long.trial, brief.trial, short.nominal):
        assert legs[0].campaign[0] == 0.0 and legs[-1].campaign[1] == 1.0
        assert all(a.campaign[1] == b.campaign[0] for a, b in pairwise(legs))
    assert max(leg.start for leg in long.nominal) < min(leg.start for leg in long.trial)
    assert len({leg.seed for leg in (*long.nominal, *long.trial)}) == 12
    assert cases.draw(6) == long != cases.draw(7)


def test_a_bank_does_not_swallow_her():
    case = cases.draw(0, cause="bank", size=1.0)
    for leg in (case.trial[3], case.trial[4]):
        voyage = cases.voyage(case, leg)
        assert voyage.y0.max() < BANK_EAST - voyage.ship.breadth / 2
        assert np.hypot(voyage.x0, voyage.y0).max() < 50.0


def test_the_command_writes_a_case(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(cases, "DURATIONS", {7000: (15.0,), 500: (5.0, 5.0)})
    folder, key = str(tmp_path / "logs"), str(tmp_path / "key.json")
    command.main(["case", "8", folder, "--key", key, "--cause", "tether", "--seconds", "500"])
    names = {p.name for p in (tmp_path / "logs").iterdir()}
    assert names == {"nominal_1.mcap", "trial_1.mcap", "trial_2.mcap"}
    estimated = json.loads((tmp_path / "key.json").read_text())
    assert estimated["verdict"] == "unknown" and estimated["structure"] == {"family": "position"}
    with pytest.raises(SystemExit):
        command.main(["case", "8", folder, "--key", f"{folder}/key.json"])
    assert "elsewhere" in capsys.readouterr().err


def test_it_shares_no_code_with_shiplog_but_the_writer():
    for source in Path(simulated_ship.__file__).parent.glob("*.py"):
        for node in ast.walk(ast.parse(source.read_text())):
            names = []
            if isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom):
                assert node.level == 0
                names = [node.module or ""]
            for name in names:
                assert not name.startswith("shiplog") or name == "shiplog.logs.conversion.write", (
                    source
                )
