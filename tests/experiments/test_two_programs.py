"""Two programs on the same cases: what both answered, who is right where the other is not."""

import pytest

from pipelines.experiments.hidden_effects import plan, two_programs
from pipelines.experiments.hidden_effects.__main__ import main
from pipelines.experiments.hidden_effects.plan import Planned
from pipelines.experiments.hidden_effects.score import Answer, Score
from pipelines.experiments.hidden_effects.validation import Mixed
from shiplog.exceptions import ShiplogError

KEY = {"verdict": "named", "causes": [{"name": "current", "size": 1.0, "parameters": {}}]}
NONE = {"verdict": "none"}


def named(name):
    return {"verdict": "named", "causes": [{"name": name, "probability": 1.0}]}


def score_of(commit, family="", first=0, **verdicts):
    """A test of one program: label without its letter → verdict."""
    answers = tuple(
        Answer(
            Planned(label, first + i, "current", 1.0, 7000, family=family), verdict, KEY,
            [{"step": "diagnose", "rc": 0, "commit": commit}],
        )
        for i, (label, verdict) in enumerate(verdicts.items())
    )  # fmt: skip
    return Score("goals", answers, (), ())


def test_chance_of_a_split():
    """By hand: twice the tail of so many fair coins."""
    assert two_programs.mcnemar(0, 5) == pytest.approx(2.0 / 32.0)
    assert two_programs.mcnemar(9, 1) == pytest.approx(2.0 * 11.0 / 1024.0)
    assert two_programs.mcnemar(3, 3) == two_programs.mcnemar(0, 0) == 1.0


def test_the_cases_that_both_answered_stand_side_by_side():
    former = score_of("a" * 40, a=NONE, b=named("bank"), c=named("current"))
    present = score_of("b" * 40, a=named("current"), b=named("current"), c=NONE, d=NONE)
    pairs = two_programs.paired([former], [present])
    assert [pair.present.planned.label for pair in pairs] == ["a", "b", "c"]  # d: one of them only
    table = two_programs.split_table(pairs).splitlines()
    cells = {row.split("|")[1].strip(): [c.strip() for c in row.split("|")[2:7]] for row in table}
    assert cells["right"] == ["0", "1", "2", "0", "1"]
    assert cells["names something wrong"] == ["0", "1", "0", "2", "1"]
    page = two_programs.page([former], [present])
    assert "## Same family of equations: 3 cases" in page and "Other families" not in page
    assert "Where the answers differ: 3 cases" in page
    line = next(line for line in page.splitlines() if line.startswith("| b "))
    assert "named bank (wrong name)" in line and line.rstrip(" |").endswith("named current")
    order = [line[2] for line in page.splitlines() if line.startswith(("| a ", "| b ", "| c "))]
    assert order == ["c", "a", "b"]  # what the present one has not right comes first


def test_places_are_apart():
    both = [[score_of(c * 40, a=NONE), score_of(c * 40, "abkowitz", 7, x=NONE)] for c in "ab"]
    page = two_programs.page(*both)
    assert "Same family of equations: 1 case\n" in page
    assert "Other families of equations: 1 case\n" in page
    assert page.count("Nowhere.") == 2


def test_what_has_no_page():
    of_a, of_b = score_of("a" * 40, a=NONE), score_of("b" * 40, b=NONE)
    with pytest.raises(ShiplogError, match="No case was answered by both"):
        two_programs.page([of_a], [of_b])
    mixed = [score_of("a" * 40, a=NONE), score_of("b" * 40, first=3, b=NONE)]
    with pytest.raises(Mixed, match="several programs"):
        two_programs.page(mixed, [score_of("c" * 40, a=NONE), score_of("c" * 40, first=3, b=NONE)])


def test_the_command_says_what_is_missing(tmp_path, capsys):
    assert main(["compare", str(tmp_path), str(tmp_path)]) == 1
    assert "holds no test of hidden effects" in capsys.readouterr().err
    for name in ("former", "present"):
        plan.save(tmp_path / name, plan.Plan("goals", 1, ()))
    assert main(["compare", str(tmp_path / "former"), str(tmp_path / "present")]) == 1
    assert "No case was answered by both" in capsys.readouterr().err
