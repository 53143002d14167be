"""At 60 and 80 columns no table cuts a name or a digit, whatever the voyages are called."""

import io
import re
import sys
from collections import Counter
from datetime import UTC, datetime

import polars as pl
import pytest
from commands import call
from hypothesis import given, settings
from hypothesis import strategies as st
from rich.cells import cell_len
from rich.console import Console

from pipelines.experiments import simulated_ship
from shiplog import cli
from shiplog.cli.terminal_tables import GAP, LEAST_OTHER, broken, drawn
from shiplog.report.diagnosis.sections import causes, limits, ranking
from shiplog.report.diagnosis.sections.causes import Estimate, NamedCause
from shiplog.report.diagnosis.sections.limits import Limit, Size
from shiplog.report.diagnosis.sections.ranking import Ranked
from shiplog.report.evaluation.tables import models_table, parameters_table
from shiplog.report.evaluation.text_table import Table, table
from shiplog.report.paper import sets

WIDTHS = (60, 80)
LONG = ("season2_harbour_manoeuvre_with_tug_23_april_first", "season2_harbour_manoeuvre_second")
RULE = "─"


def printed(found: Table, width: int) -> list[list[str]]:
    """Lines of each block."""
    blocks = []
    for block in drawn(found, width):
        stream = io.StringIO()
        Console(file=stream, width=width).print(block)
        blocks.append(stream.getvalue().splitlines())
    return blocks


def letters(text: str) -> Counter:
    return Counter(c for c in text if not c.isspace() and c != RULE)


def whole(found: Table, width: int) -> None:
    """Every letter of every cell is there; of the first column in each block, or the heads in each
    row."""
    blocks = printed(found, width)
    if not any(RULE in line for line in blocks[0]):
        text = "".join("".join(lines) for lines in blocks)
        heads = "".join(found.head) * len(found.rows) + ":" * len(found.rows)
        assert letters(text) == letters(heads + "".join("".join(row) for row in found.rows))
        assert all(cell_len(line) <= width for lines in blocks for line in lines)
        return
    first = [found.head[0], *(row[0] for row in found.rows)]
    others = [*found.head[1:], *(cell for row in found.rows for cell in row[1:])]
    text = "".join("".join(lines) for lines in blocks)
    assert letters(text) == letters("".join(first * len(blocks) + others))
    assert all(cell_len(line) <= width for lines in blocks for line in lines)
    words = {word for lines in blocks for line in lines for word in line.split()}
    most = width - 2 * GAP - LEAST_OTHER
    numbers = {cell for cell in others if re.fullmatch(r"[-+.\deE]+", cell)}
    assert {number for number in numbers if len(number) < LEAST_OTHER} <= words
    assert {cell for cell in first if " " not in cell and 0 < len(cell) <= most} <= words


cells = st.text("ab_-.:漢 123", max_size=70).map(str.strip)


@settings(max_examples=150, deadline=None)
@given(
    st.integers(1, 9).flatmap(
        lambda n: st.tuples(
            st.lists(cells.filter(bool), min_size=n, max_size=n),
            st.lists(st.lists(cells, min_size=n, max_size=n), min_size=1, max_size=3),
        )
    ),
    st.sampled_from(WIDTHS),
)
def test_any_table_keeps_every_letter(content, width):
    head, rows = content
    whole(table(head, rows), width)


def test_two_long_names_stay_apart():
    found = table(("voyage", "L", "windows"), [(f"{LONG[0]}_{i}", 1234.0, 9) for i in (1, 2)])
    for width in WIDTHS:
        text = "\n".join(line for lines in printed(found, width) for line in lines)
        ends = re.findall(r"first_(\d)|first_\s+\d|(?<=_)first", text)
        assert ends, text
        whole(found, width)


def test_a_name_breaks_at_its_seams():
    assert broken("season2_harbour_manoeuvre", 20) == "season2_harbour_\nmanoeuvre"
    assert broken("abcdefghij", 4) == "abcd\nefgh\nij"
    assert broken("two words", 5) == "two words"


def test_a_table_that_fits_is_one_block():
    assert len(printed(table(("a", "b"), [(1, 2)]), 60)) == 1


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.fixture(scope="module")
def long_names(tmp_path_factory):
    """Two voyages of long names, ingested, and an MMG that was fitted to none."""
    folder = tmp_path_factory.mktemp("long_names")
    for number, name in enumerate(LONG):
        voyage = simulated_ship.sail(60.0, seed=number, wind=simulated_ship.Wind(3.0, 1.0))
        start = datetime(2026, 5, 1, 10 + number, 0, tzinfo=UTC)
        simulated_ship.write_voyage(folder / f"{name}.mcap", voyage, seed=number, start=start)
    store, run = folder / "store", folder / "run_with_a_name_that_says_what_it_is_made_of"
    assert call("ingest", folder, "--store", store)[0] == 0
    fixed = ("--no-fit", "--without", "propeller", "--without", "rudder", "--window", 25)
    chosen = ("--model", "mmg", "--voyages", LONG[0])
    assert call("train", "--store", store, "--out", run, *chosen, *fixed)[0] == 0
    return folder, store, run


@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("command", ["voyages", "sensors", "check", "evaluate", "compare"])
def test_a_command_in_a_terminal_names_its_voyages_in_full(
    long_names, command, width, monkeypatch, tmp_path
):
    folder, store, run = long_names
    lines = {
        "voyages": ["voyages", "--store", store],
        "sensors": ["voyages", "--sensors", "--store", store],
        "check": ["check", *(folder / f"{name}.mcap" for name in LONG)],
        "evaluate": ["evaluate", run, "--store", store, "--voyages", LONG[1]],
        "compare": [
            "compare", run, "--store", store, "--voyages", LONG[1], "--save", tmp_path / "a.rrd",
        ],
    }  # fmt: skip
    monkeypatch.setenv("COLUMNS", str(width))
    monkeypatch.setattr(sys, "stdout", shown := Terminal())
    assert cli.run([str(word) for word in lines[command]]) == 0
    text = shown.getvalue()
    named = (LONG[1],) if command in ("evaluate", "compare") else LONG
    assert all(name in text for name in named), text
    assert "…" not in text
    tables = [line for line in text.splitlines() if RULE in line]
    assert all(cell_len(line) <= width for line in tables)


@pytest.mark.parametrize("width", WIDTHS)
def test_the_tables_of_a_verdict_fit(width):
    label = "rudder_offset:the_rudder_on_the_starboard_side_of_the_hull"
    named = NamedCause(
        name=label, probability=0.9, sentence="", equation="",
        parameters={label: Estimate(-12.345, -13.21, -11.02, "deg/s"),
                    "channel": Estimate(label, label, label, "")},
    )  # fmt: skip
    limit = Limit(label, 0.4, {label: Size(0.123, "m/s"), "direction": Size(12.3, "deg")})
    lines = [
        *ranking.markdown([Ranked(label, 0.987), Ranked("none", 0.013)]),
        *limits.markdown([limit]),
        *causes.markdown([named]),
    ]
    found = [line for line in lines if isinstance(line, Table)]
    assert len(found) == 3
    for one in found:
        whole(one, width)


@pytest.mark.parametrize("width", WIDTHS)
def test_the_tables_of_the_papers_experiment_fit(width):
    plans = {name: pl.DataFrame({"voyage": ["a"] * 1234}) for name in ("sli10xjit10", "d-ref")}
    sizes = sets.sizes(plans, dict.fromkeys(plans, LONG), 100)
    whole(table(tuple(sizes.columns), sizes.rows()), width)
    models = {name: {"loss": 1234.5, "seeds": [1000.0, 1500.0], "rmse": dict.fromkeys(
        ("surge", "sway", "yaw_rate"), 0.0123), "end_position_m": 12.3, "end_heading_deg": 4.5}
        for name in LONG}  # fmt: skip
    whole(models_table(models, {"hold": 37737.0, "least_squares": 4764.0}, LONG[0]), width)
    parameters = pl.DataFrame({
        "name": ["hull.y_vvr"], "symbol": ["Y'_vvr"], "meaning": ["sway of drifting and turning"],
        "start": [-1.234], "spread": [0.1], "value": [-1.345], "standard_error": [0.0123],
        "free": [True],
    })  # fmt: skip
    whole(parameters_table(parameters), width)
