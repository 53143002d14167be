"""limits.toml from today's results, which today's results keep."""

import math

import pytest
from gate_answers import CURRENT, LATE, evaluation, found

from shiplog.exceptions import RunError
from shiplog.report.gate import golden, judging
from shiplog.report.gate.limits_file import given, parse

INSIDE = {"surge": 0.93, "sway": 0.05}


def states(text, results, verdict=None):
    limits = parse(text, "limits.toml")
    outcomes = judging.of_windows(limits, results.voyages, results, "")
    if verdict is not None:
        outcomes += judging.of_verdict(limits, verdict)
    return [one.state for one in outcomes]


@pytest.mark.parametrize(
    "results",
    [evaluation(range(1, 9), inside=INSIDE), evaluation((1.0, 3.0), voyages=("a", "b")),
     evaluation(range(1, 9), seeds=(0, 1)), evaluation((math.inf, *range(1, 8)))],
    ids=["intervals", "few windows", "seeds", "diverged"],
)  # fmt: skip
@pytest.mark.parametrize(
    "verdict",
    [None, found(), found("named", causes=[CURRENT, LATE]), found("undecided"),
     found("none", traces=[CURRENT])],
    ids=["without", "none", "named", "undecided", "trace"],
)  # fmt: skip
def test_today_s_results_keep_them(results, verdict):
    found_ = states(golden.text(results, verdict), results, verdict)
    assert len(found_) >= 4 and set(found_) == {"holds"}


def test_the_margin_is_the_root_of_two_half_widths():
    results = evaluation(range(1, 9), inside=INSIDE)
    limits = parse(golden.text(results, None), "limits.toml")
    one = judging.of_windows(limits, results.voyages, results, "")[0]
    measured, limit = one.measured, given(limits.simulation)["loss"]
    exact = 4.5 + math.sqrt(2.0) * (measured.high - 4.5)
    assert exact <= limit <= exact * 1.1  # two digits, rounded up
    assert given(limits.band) == {"surge": 0.83}  # 0.1 below; of sway nothing is left


def test_of_few_windows_errors_may_grow_by_a_half():
    limits = parse(golden.text(evaluation((1.0, 3.0), voyages=("a", "b")), None), "limits.toml")
    kept = given(limits.simulation)
    assert kept["end_position_m"] == 3.0 and kept["loss"] == 4.5  # L goes with the square
    assert kept["covered"] == 0.4


def test_only_what_is_there_is_limited_and_only_that_may_be_named():
    text = golden.text(evaluation(1.0), found("named", causes=[CURRENT, LATE]))
    limits = parse(text, "limits.toml")
    assert limits.diagnosis.allowed == ("named", "none")
    assert limits.diagnosis.causes_allowed == ("current", "clock_offset:gnss")
    # 0.10 + √2 · 0.02 = 0.128 and 0.3 + √2 · 0.1 = 0.441
    assert limits.sizes == {"current": {"speed": 0.13}, "clock_offset:gnss": {"time": 0.45}}
    assert "# fouling.factor: not found, detectable from 0.1\n" in text
    assert "direction" not in text


def test_a_file_that_is_there_stays(tmp_path):
    text = golden.text(evaluation(range(1, 9)), None)
    path = tmp_path / "limits.toml"
    assert golden.write(path, text) == 9
    path.write_text("mine")
    with pytest.raises(RunError, match="exists already"):
        golden.write(path, text)
    assert path.read_text() == "mine"


def test_names_of_strangers_stay_in_their_comment():
    evil = 'x"\n[simulation]\nloss = 1e9 #'
    results = evaluation(2.0, voyages=(evil,) * 8)
    assert given(parse(golden.text(results, None), "l.toml").simulation)["loss"] == 2.0
