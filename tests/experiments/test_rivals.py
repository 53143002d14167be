"""The diagnosis' rivals on Gaussian systems with known answers; their seal and their table."""

import ast
import hashlib
import json
import math
import os
import sys
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import straight
from jax.typing import ArrayLike

from pipelines.experiments.hidden_effects import plan, rivals, run, score, score_tables, suites
from pipelines.experiments.hidden_effects.plan import Planned
from pipelines.experiments.hidden_effects.score import Answer, Sealed
from shiplog.diagnosis.linear_segments import Linear
from shiplog.diagnosis.linear_segments import Path as Along
from shiplog.diagnosis.parameter_layout import Columns
from shiplog.diagnosis.segments import BIN, Cut

ROOT = Path(__file__).parents[2]
OURS = ("pipelines.", "shiplog.")
START = np.array([2.0, 0.5, 2.0, 0.5, 0.3, 0.2])
NOISE = np.array([0.02, 0.01, 0.03, 0.015, 0.004, 0.002])


# --- an answer ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("scores", "wanted", "answer"),
    [
        ({"a": 3.0, "b": 5.0}, 0.0, "b"),
        ({"a": -3.0, "b": -0.1}, 0.0, None),
        ({"a": 3.0, "b": 5.0}, 8.0, None),
        ({"a": 3.0, "b": 5.0}, {"a": 1.0, "b": 6.0}, None),  # the first alone is asked
        ({}, 0.0, None),
    ],
)
def test_the_first_is_the_answer_or_none(scores, wanted, answer):
    one = rivals.reported(scores, wanted)
    assert one.answer == answer
    assert list(one.scores.values()) == sorted(scores.values(), reverse=True)


# --- regression -----------------------------------------------------------------------------------


def regressed(size: float, noise: float = 1.0, seed: int = 0):
    rng = np.random.default_rng(seed)
    sd = np.array([0.01, 0.02, 1.0])
    columns = {name: rng.standard_normal((400, 3, k)) * sd[:, None] for name, k in
               (("right", 2), ("other", 1), ("third", 12))}  # fmt: skip
    columns["unseen"] = np.zeros((400, 3, 2))
    rest = columns["right"] @ np.array([size, -size]) + noise * sd * rng.standard_normal((400, 3))
    return rivals.bic(rest, columns, sd)


def test_what_was_added_is_found_and_nothing_is_not():
    """RSS falls from n (1 + 2 · 0.5²) to n: ½ n log 1.5 of BIC, give or take noise."""
    found = regressed(0.5)
    assert rivals.reported(found).answer == "right"
    wanted = 0.5 * (1200 * math.log(1.5) - 2 * math.log(1200))
    assert found["right"] == pytest.approx(wanted, rel=0.15)
    assert found["unseen"] == pytest.approx(-math.log(1200))  # ½ k log n with k = 2
    alarms = sum(
        rivals.reported(regressed(0.0, seed=seed)).answer is not None for seed in range(40)
    )
    assert alarms <= 3  # P(χ²₁ > log 1200) = 0.8 % for one number, less for more: 0.35 expected


def test_bic_is_that_of_the_textbook_in_any_unit():
    """y = (1, 2, 3, 4, 5, 6) on a constant: RSS 91 and 17.5."""
    rest = np.arange(1.0, 7.0).reshape(2, 3)
    constant = {"constant": np.full((2, 3, 1), 1e-9)}
    found = rivals.bic(rest, constant, np.ones(3))
    wanted = 0.5 * (6 * math.log(91.0 / 17.5) - math.log(6))
    assert found["constant"] == pytest.approx(wanted)


@partial(jax.tree_util.register_dataclass, data_fields=["drag"], meta_fields=[])
@dataclass(frozen=True)
class Sled:
    """ν̇ = -drag ν + p + rudder: straight, and no wind."""

    drag: ArrayLike

    def acceleration(self, theta, state, actuator, true_wind):
        velocity = state[..., jnp.array([1, 3, 5])]
        return -self.drag * velocity + theta + actuator[..., :1]


def test_the_acceleration_of_a_known_motion_is_the_models_and_what_was_added_is_left():
    """ν = exp(-t/τ) ν₀, averaged over 2 s exactly; a decay slow against the bins."""
    drag, added = 0.02, np.array([0.03, -0.02, 0.01])
    edge = BIN * np.arange(16)
    start = np.array([1.0, -0.5, 0.2]) - added / drag
    mean = -np.diff(np.exp(-drag * edge)) / (drag * BIN)
    y = np.zeros((1, 15, 6))
    y[0][:, rivals.VELOCITY] = mean[:, None] * start + added / drag
    driven = np.zeros((1, 15, 4))
    found = rivals.beyond(Sled(drag), np.zeros(3), y, driven)
    assert found.shape == (1, 13, 3)
    assert found[0] == pytest.approx(np.broadcast_to(added, (13, 3)), abs=2e-5)
    known = rivals.beyond(Sled(drag), added, y, driven)
    assert known == pytest.approx(np.zeros((1, 13, 3)), abs=2e-5)


def test_both_sides_are_averaged_alike():
    """A rudder that jumps and pushes at once: nothing is left, though no bin shows when."""
    accelerated = np.zeros((1, 151))
    accelerated[0, 70:] = 0.1  # at the nodes, every 0.2 s
    accelerated[0, 70] = 0.05
    steps = 0.1 * (accelerated[0, 1:] + accelerated[0, :-1])
    velocity = np.concatenate(([0.0], np.cumsum(steps)))
    y = np.zeros((1, 15, 6))
    y[0, :, 1] = rivals.of_bins(velocity[None], 15)[0]
    driven = np.zeros((1, 151, 4))
    driven[..., 0] = accelerated
    left = rivals.beyond(Sled(0.0), np.zeros(3), y, rivals.of_bins(driven, 15))
    assert left[..., 0] == pytest.approx(np.zeros((1, 13)), abs=0.004)  # of 0.1


# --- likelihood ratios ----------------------------------------------------------------------------


def rolled(segments: int, numbers, seed: int = 0, columns: int = 5, noise=NOISE) -> Linear:
    """Random columns; what was measured is a free start, those numbers and white noise, as if no
    acceleration at the knots had ever been there."""
    rng = np.random.default_rng(seed)
    shape = (segments, 8, 6)
    used = np.ones(shape, dtype=bool)
    used[0, 1] = False
    cut = Cut(np.arange(segments), np.zeros(shape), used, np.zeros((segments, 1, 1)),
              np.zeros(segments, dtype=int), 0.2)  # fmt: skip
    z = rng.standard_normal((*shape, 15)) * noise[:, None] * 5.0
    j = rng.standard_normal((*shape, columns)) * noise[:, None]
    e = j @ np.asarray(numbers) + noise * rng.standard_normal(shape)
    e += np.einsum("sbcz,sz->sbc", z[..., :6], rng.standard_normal((segments, 6)))
    along = Along(np.zeros((segments, 6)), np.zeros((segments, 3, 3)))
    return Linear(cut, along, e, z, j)


def chi2_of(given: Linear, chosen, information, pull) -> float:
    """Least squares over all starts and numbers at once, written out row by row."""
    rows, right = [], []
    count = len(given.e)
    width = 6 * count + len(chosen)
    for s in range(count):
        used = given.cut.used[s]
        block = np.zeros((int(used.sum()), width))
        scale = np.broadcast_to(NOISE, used.shape)[used]
        block[:, 6 * s : 6 * s + 6] = given.z[s][used][:, :6] / scale[:, None]
        block[:, 6 * count :] = given.j[s][used][:, chosen] / scale[:, None]
        rows.append(block)
        right.append(given.e[s][used] / scale)
    held = np.zeros((6 * count, width))
    held[:, : 6 * count] = np.diag(np.tile(1.0 / START, count))
    root = np.linalg.cholesky(information)
    prior = np.zeros((len(pull), width))
    prior[:, 6 * count : 6 * count + len(pull)] = root.T
    rows += [held, prior]
    right += [np.zeros(6 * count), np.linalg.solve(root, pull)]
    x, y = np.concatenate(rows), np.concatenate(right)
    left = y - x @ np.linalg.lstsq(x, y, rcond=None)[0]
    return float(left @ left)


def test_ratios_are_those_of_least_squares_over_everything():
    given = rolled(4, [0.3, -0.2, 0.5, 0.0, 0.1])
    unit = np.array([1.0, 0.1, 5.0, 1.0, 2.0])
    information, pull = np.array([[9.0, 1.0], [1.0, 4.0]]), np.array([2.0, -1.0])
    tried = {"one": np.array([2]), "two": np.array([3, 4])}
    total = rivals.white_total(given, NOISE, START, unit)
    found = rivals.ratios(total, information, pull, tried)
    by = np.diag(1.0 / unit[:2])  # dense, numbers as they are
    dense = by @ information @ by, by @ pull
    none = chi2_of(given, [0, 1], *dense)
    for label, at in tried.items():
        wanted = none - chi2_of(given, [0, 1, *at], *dense)
        assert found[label] == pytest.approx(wanted, rel=1e-6)


def test_numbers_that_change_nothing_bring_nothing():
    given = rolled(4, [0.3, 0.0, 0.0, 0.0, 0.0])
    given.j[..., 2] = given.j[..., 1]  # two numbers, one effect
    total = rivals.white_total(given, NOISE, START, np.ones(5))
    tried = {"once": np.array([1]), "twice": np.array([1, 2])}
    found = rivals.ratios(total, np.eye(1), np.zeros(1), tried)
    assert found["twice"] == pytest.approx(found["once"])


def test_noise_and_coefficients_of_the_nominal_voyages_are_learnt():
    true = np.array([0.8, -0.6, 0.0, 0.0, 0.0])
    given = rolled(150, true)
    columns = Columns(2, (), np.array([1.0, 0.5, 1.0, 1.0, 1.0]))
    white = rivals.learnt(given, columns, START, 10.0 * NOISE)
    assert white.noise == pytest.approx(NOISE, rel=0.08)
    solved = np.linalg.solve(white.information, white.pull) * columns.unit[:2]
    assert solved == pytest.approx(true[:2], abs=0.05)
    sd = np.sqrt(np.diag(np.linalg.inv(white.information))) * columns.unit[:2]
    assert (sd < 0.02).all()  # 7200 numbers less 900 starts, each as large as its noise


def test_a_trial_whose_model_has_a_discrepancy_is_compared_without_it():
    """Its columns are of no simpler method: what was hidden is found by the ratio all the same."""
    columns = straight.columns_of(straight.CAUSES)
    nominal, record = straight.sailed(12), straight.sailed(8, seed=3)
    passed = straight.passed(nominal, columns, noise=0.3, sensitivity=0.3)
    campaign = straight.campaign(nominal, passed, columns)
    assert campaign.reference.columns.misfit > 0
    hidden = np.zeros(columns.linearised)
    hidden[columns.of["drag"]] = 1.5
    given = straight.passed(record, columns, hidden, seed=2, noise=0.3, sensitivity=0.3)
    trial = straight.trial(campaign, record, given)
    found = rivals.likelihood_ratio(trial, trial.at({}))
    assert found.answer == "drag"
    assert set(found.scores) == {c.label for c in straight.CAUSES}


# --- the seal -------------------------------------------------------------------------------------


def methods(**named):
    ranking = [{"name": "current", "score": 3.0}]
    return {n: {"answer": named.get(n), "ranking": ranking} for n in score_tables.RIVALS}


def sealed(path: Path, content) -> None:
    path.write_text(json.dumps(content))
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    path.with_suffix(".sha256").write_text(f"{digest}  {path.name}\n")


def test_rivals_count_only_as_they_were_sealed(tmp_path):
    """There is no key here: whoever tried to open it would raise something else."""
    out = tmp_path / "out"
    planned = plan.save(out, suites.plan("nightly", 5, 1)).cases[0]
    folder, key = plan.case_folder(out, planned), plan.key_path(out, planned)
    folder.mkdir(parents=True)
    sealed(folder / "verdict.json", {"verdict": "none", "causes": []})
    (folder / "steps.json").write_text(json.dumps([{"step": "logs", "rc": 0}]))
    sealed(folder / "rivals.json", {"methods": methods(glr="current")})
    (folder / "rivals.json").write_text(json.dumps({"methods": methods(glr="fouling")}))
    with pytest.raises(Sealed, match=r"rivals\.json is not what was sealed: the key .* not opened"):
        score.read(out)
    (folder / "rivals.json").unlink()
    with pytest.raises(Sealed):
        score.read(out)
    key.write_text(json.dumps({"verdict": "none", "causes": [], "structure": None}))
    (folder / "rivals.sha256").unlink()
    (folder / "rivals.json").write_text(json.dumps({"methods": methods(glr="current")}))
    assert score.read(out).answers[0].rivals == {}  # never sealed: never read
    sealed(folder / "rivals.json", {"methods": methods(glr="current")})
    assert score.read(out).answers[0].by("glr").misnamed


# --- the table ------------------------------------------------------------------------------------


def answer(hidden, reported, size=1.0, seconds=7000, rivals=None, steps=()):
    causes = [{"name": hidden, "size": size, "parameters": {}}] if hidden else []
    key = {"verdict": "named" if hidden else "none", "causes": causes, "structure": None}
    verdict = {
        "verdict": "named" if reported else "none",
        "causes": [{"name": n} for n in reported],
    }
    return Answer(Planned("1", 1, None, None, seconds), verdict, key, list(steps), rivals or {})


def test_the_table_counts_by_hand():
    clock = methods(regression="clock_offset:wind", glr="clock_offset:gnss", linear="bank")
    wrong = methods(regression="bank", glr="bank")
    answers = [
        answer("clock_offset", ["clock_offset:gnss"], rivals=clock),
        answer("clock_offset", ["clock_offset", "bank"], rivals=clock),  # one too many
        answer("current", ["current"], size=0.3, rivals=wrong),
        answer("current", ["current"], seconds=500, rivals=methods(linear="current")),
        answer(None, [], rivals=wrong),
        answer(None, [], rivals=methods()),
        answer("current", [], steps=[{"step": "rivals", "rc": 1}]),  # they failed: no part of it
    ]  # fmt: skip
    lines = score_tables.methods(answers).splitlines()
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[:-1]]
    assert rows[0][0] == "method, 6 cases"
    assert rows[0][1:] == ["size 1", "0.3 to 1", "500 s", "nothing hidden: a cause named"]
    assert [row[1:] for row in rows[2:]] == [
        ["2/2 (100 %)", "0/1 (0 %)", "0/1 (0 %)", "1/2 (50 %)"],
        ["2/2 (100 %)", "0/1 (0 %)", "0/1 (0 %)", "1/2 (50 %)"],
        ["0/2 (0 %)", "0/1 (0 %)", "1/1 (100 %)", "0/2 (0 %)"],
        ["1/2 (50 %)", "1/1 (100 %)", "1/1 (100 %)", "0/2 (0 %)"],
    ]  # fmt: skip
    assert rows[-1][0] == "shiplog diagnose"
    assert lines[-1] == "1 more where the simpler methods failed"
    assert "method, 6 cases" in score_tables.text(score.Score("goals", tuple(answers), (), ()))
    assert "method," not in score_tables.text(score.Score("goals", tuple(answers[-1:]), (), ()))


# --- the step -------------------------------------------------------------------------------------

SIMULATOR = """
import json, pathlib, sys
seed, logs, _, key, *options = sys.argv[1:]
pathlib.Path(logs).mkdir()
pathlib.Path(key).write_text(json.dumps({"verdict": "none", "causes": [], "structure": None}))
"""
SHIPLOG = """
import json, os, pathlib, sys
command, first, *options = sys.argv[1:]
given = {k: v for k, v in zip(options, options[1:])}
made = {"ingest": "--store", "train": "--out"}.get(command)
if made:
    pathlib.Path(given[made]).mkdir()
elif os.environ["BREAK"] == "diagnose":
    sys.exit(1)
else:
    pathlib.Path(given["--json"]).write_text(json.dumps({"verdict": "none", "causes": []}))
"""
RIVAL = """
import json, os, pathlib, sys
base, *options = sys.argv[1:]
given = {k: v for k, v in zip(options, options[1:])}
json_ = pathlib.Path(given["--json"])
assert "keys" not in " ".join(sys.argv) and given["--voyages"] == "trial_*"
assert pathlib.Path(base).is_dir() and pathlib.Path(given["--store"]).is_dir()
assert (json_.parent / "verdict.sha256").exists()  # they come last
json_.write_text("half of" if os.environ["BREAK"] == "rivals" else '{"methods": {}}')
sys.exit(os.environ["BREAK"] == "rivals")
"""


@pytest.fixture
def stubs(tmp_path, monkeypatch):
    monkeypatch.setenv("BREAK", "nothing")
    commands = {}
    programs = (("case", SIMULATOR), ("shiplog", SHIPLOG), ("rival", RIVAL))
    for name, program in programs:
        (tmp_path / f"{name}.py").write_text(program)
        commands[name] = (sys.executable, str(tmp_path / f"{name}.py"))
    return lambda **more: run.Settings(**commands, **more)


def files(out: Path) -> set[str]:
    return {p.name for p in (out / "cases" / "5").iterdir()}


KEPT = {"verdict.json", "verdict.sha256", "steps.json"}
ANSWERED = {"rivals.json", "rivals.sha256"}


def steps(out: Path) -> list[tuple[str, int]]:
    found = json.loads((out / "cases" / "5" / "steps.json").read_text())
    return [(step["step"], step["rc"]) for step in found]


@pytest.mark.parametrize("broken", ["nothing", "diagnose"])
def test_rivals_answer_after_the_verdict_is_sealed(tmp_path, stubs, monkeypatch, broken):
    """Even where the diagnosis broke: its failures count in the comparison."""
    monkeypatch.setenv("BREAK", broken)
    out = tmp_path / "out"
    run.run(out, plan.save(out, suites.plan("nightly", 5, 1)), stubs(rivals=True))
    assert files(out) == KEPT | ANSWERED
    assert steps(out)[-1] == ("rivals", 0)
    assert score.read(out).answers[0].verdict["verdict"] == (
        "failed" if broken == "diagnose" else "none"
    )


def test_rivals_that_break_spoil_nothing_and_a_kept_case_is_asked_again(
    tmp_path, stubs, monkeypatch
):
    monkeypatch.setenv("BREAK", "rivals")
    out = tmp_path / "out"
    planned = plan.save(out, suites.plan("nightly", 5, 1))
    run.run(out, planned, stubs(rivals=True, keep=True))
    assert files(out) == KEPT | {"logs", "store", "base"}
    assert steps(out)[-1] == ("rivals", 1)
    assert score.read(out).answers[0].right
    before = os.stat(out / "cases" / "5" / "verdict.json").st_mtime_ns
    monkeypatch.setenv("BREAK", "nothing")
    run.run(out, planned, stubs(keep=True))
    assert not files(out) & ANSWERED
    run.run(out, planned, stubs(rivals=True))
    assert files(out) == KEPT | ANSWERED | {"logs", "store", "base"}
    assert [name for name, _ in steps(out)] == ["logs", "ingest", "train", "diagnose", "rivals"]
    assert os.stat(out / "cases" / "5" / "verdict.json").st_mtime_ns == before


def imported(source: Path):
    """Modules, and what may be one: `from pipelines import x` too."""
    for node in ast.walk(ast.parse(source.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def test_rivals_know_nothing_of_the_simulator():
    """Nor does anything of ours that they import, however far down."""
    met, waiting = set(), ["pipelines.experiments.hidden_effects.rivals"]
    while waiting:
        name = waiting.pop()
        path = ROOT / name.replace(".", "/")
        source = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
        if name in met or not source.exists():
            continue
        met.add(name)
        waiting += [module for module in imported(source) if module.startswith(OURS)]
    assert "shiplog.diagnosis.evidence" in met
    assert not any(name.startswith("pipelines.experiments.simulated_ship") for name in met)
