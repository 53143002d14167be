"""What is certain is put right by what was hidden, reported, and undone by ingesting again."""

import json
from dataclasses import replace
from datetime import UTC, datetime, timedelta

import numpy as np
import polars as pl
import pytest
from commands import call
from test_sensor_consistency import BODY, DEGREE, VECTWIN, in_body_axes

from pipelines.experiments.simulated_ship import Effects, Wind, cases, sail, write_voyage
from shiplog.logs.health.health_report import VoyageReport
from shiplog.nomenclature.channels import UNUSABLE, Quality
from shiplog.voyages.ingest.ingest import Voyage, ingest, usable
from shiplog.voyages.ingest.sensor_correction import corrected, put_right
from shiplog.voyages.rows import one_hertz
from shiplog.voyages.sensors import sensor_consistency
from shiplog.voyages.sensors.comparison import compare
from shiplog.voyages.sensors.sensor_findings import Estimate
from shiplog.voyages.store.store import Store


def certain(table):
    return [e for e in sensor_consistency.estimates(table, BODY) if e.certain]


def left(table, profile=BODY):
    return {(e.kind, e.channel) for e in sensor_consistency.estimates(table, profile) if e.notable}


def late(channel, seconds):
    return Estimate("clock_offset", channel, seconds, seconds, seconds, 0.0, 0.05, "s")


@pytest.mark.parametrize(
    ("effects", "columns", "near"),
    [
        ({"heading_offset": 2.0}, ["heading"], 0.1 * DEGREE),
        ({"speed_scale": 0.04}, ["surge", "sway"], 0.003),
        ({"antenna": (0.3, -0.2)}, ["x0", "y0"], 0.03),
    ],
    ids=["heading", "speed", "antenna"],
)
def test_a_table_becomes_the_one_without_the_fault(effects, columns, near):
    clean, faulty = in_body_axes(1, seconds=500.0), in_body_axes(1, seconds=500.0, **effects)
    faults = certain(faulty)
    fixed, gaps = put_right(faulty, BODY, faults)
    assert {e.kind for e in faults} and left(fixed) == set() and gaps == []
    for name in columns:
        assert fixed[name].to_numpy() == pytest.approx(clean[name].to_numpy(), abs=near)
    others = [c for c in clean.columns if c not in columns]
    assert fixed.select(others).to_numpy() == pytest.approx(clean.select(others).to_numpy())


def test_a_late_yaw_rate_comes_when_the_ship_turned():
    true = sail(500.0, seed=3, wind=Wind(2.0, 1.0)).yaw_rate
    faulty = in_body_axes(3, late={"yaw_rate": 0.6}, seconds=500.0)
    fixed, gaps = put_right(faulty, BODY, certain(faulty))

    def error(table):
        return float(np.nanstd(table["yaw_rate"].fill_null(np.nan).to_numpy() - true))

    noise = 0.1 * DEGREE
    assert error(fixed) < noise < 0.8 * error(faulty)
    assert ("clock_offset", "yaw_rate") not in left(fixed)
    assert fixed.height == faulty.height and fixed["time"].equals(faulty["time"])
    (gap,) = [f for f in gaps if f.channel == "yaw_rate"]
    assert gap.value == pytest.approx(0.6, abs=0.1) and gap.end_s == pytest.approx(500.1, abs=0.01)
    assert fixed["yaw_rate"].null_count() == round(gap.value / 0.1)


@pytest.mark.parametrize(("channel", "columns"), [
    ("velocity", ["surge", "sway"]), ("position", ["x0", "y0"]),
    ("gnss", ["x0", "y0", "surge", "sway"]), ("yaw_rate", ["yaw_rate"]),
])  # fmt: skip
def test_a_clock_moves_its_own_channel_and_no_other(channel, columns):
    count = 200
    line = pl.DataFrame(
        {"time": 0.1 * np.arange(count)}
        | {c: c0 + 0.3 * np.arange(count) for c, c0 in
           (("x0", 1.0), ("surge", 2.0), ("y0", 3.0), ("sway", 4.0), ("yaw_rate", 5.0))}
        | {"heading": np.zeros(count), "quality": np.zeros(count, np.int32)}
    )  # fmt: skip
    fixed, _ = put_right(line, BODY, [late(channel, 0.5)])
    for name in ("x0", "surge", "y0", "sway", "yaw_rate"):
        steps = 5 if name in columns else 0
        assert fixed[name].to_numpy()[:190] == pytest.approx(line[name].to_numpy()[:190]
                                                             + 0.3 * steps)  # fmt: skip


def test_no_data_stays_as_it_was_and_is_fetched_for_no_other_row():
    table = in_body_axes(3, seconds=100.0)
    marks, x0 = table["quality"].to_numpy().copy(), table["x0"].to_numpy().copy()
    marks[100:110], x0[100:110] = int(Quality.GAP), np.nan
    marks[300], x0[300] = int(Quality.SPIKE), 99.0
    marks[500] = int(Quality.LIMITS)  # of an actuator: the position there is as good as any
    marks[700], x0[700:] = int(Quality.JUMP), x0[700:] + 6.0
    table = table.with_columns(quality=marks, x0=x0).with_columns(pl.col("x0").fill_nan(None))
    fixed, _ = put_right(table, BODY, [late("position", 0.45)])
    unusable = pl.Series((marks & int(UNUSABLE)) != 0)
    assert fixed.filter(unusable).equals(table.filter(unusable))
    became = np.flatnonzero((fixed["quality"].to_numpy() & int(Quality.GAP)) & ~marks)
    fetched = (range(95, 100), range(105, 110), (295, 296), range(695, 700), range(996, 1001))
    assert became.tolist() == [i for rows in fetched for i in rows if not unusable[i]]
    assert fixed["x0"].null_count() == 10 + len(became)
    step = (fixed["x0"] - table["x0"]).abs().to_numpy()
    assert np.nanmax(np.delete(step, [300])) < 1.0  # nothing of the spike, nothing across the jump


def test_a_jump_is_still_one_where_an_early_clock_has_nothing_to_fetch():
    """The row after the step becomes a gap: the stretches are apart all the same."""
    table = in_body_axes(3, seconds=100.0)
    marks, x0 = table["quality"].to_numpy().copy(), table["x0"].to_numpy().copy()
    marks[704], x0[704:] = int(Quality.JUMP), x0[704:] + 500.0
    table = table.with_columns(quality=marks, x0=x0)
    fixed, _ = put_right(table, BODY, [late("position", -0.15)])
    assert fixed["quality"][704] & int(Quality.GAP)
    start = datetime(2026, 5, 1, tzinfo=UTC)
    stamps = [start + timedelta(milliseconds=100 * i) for i in range(table.height)]
    named = fixed.with_columns(voyage=pl.lit("a"), time=pl.Series(stamps).cast(pl.Datetime("ns")))
    seconds = one_hertz.resample([named.lazy()], ("x0",), ())
    assert seconds["segment"].n_unique() == 2
    steps = seconds.select(pl.col("x0").diff().abs().over("segment")).to_series()
    assert (steps.drop_nulls() < 10.0).all()


def test_only_the_beyond_doubt_is_certain():
    def estimate(half, rival=""):
        return Estimate("clock_offset", "velocity", 0.4, 0.4 - half, 0.4 + half, 0.0, 0.05, "s",
                        rival)  # fmt: skip

    assert estimate(0.15).notable and not estimate(0.15).certain
    assert estimate(0.09).certain
    assert estimate(0.01, "position").notable and not estimate(0.01, "position").certain


@pytest.mark.parametrize("seed", [0, 1])
def test_what_a_case_hides_in_the_gyro_is_gone(tmp_path, seed):
    # twice the realistic size: 500 s leave doubt about a scale of 3 %, and doubt is not corrected
    case = cases.draw(seed, cause="yaw_rate_bias+yaw_rate_scale", size=2.0, seconds=500)
    leg = case.trial[0]
    write_voyage(tmp_path / "t.mcap", cases.voyage(case, leg), seed=leg.seed, start=leg.start)
    found = ingest(tmp_path / "t.mcap", VECTWIN)
    fixed = corrected(found)
    truth = {cause.name: cause.parameters["value"]["value"] for cause in case.causes}
    assert {e.kind for e in fixed.corrected or ()} == set(truth)
    assert (fixed.report.usable_s, fixed.report.windows) == usable(fixed.table, VECTWIN)
    for e in fixed.corrected or ():
        assert abs(e.value - truth[e.kind]) < e.high - e.low  # twice the half of 90 %
    assert left(found.table, VECTWIN) >= {(kind, "yaw_rate") for kind in truth}
    assert left(fixed.table, VECTWIN) == set()


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    """A yaw rate that is late and biased, and a velocity whose clock differs from the position's:
    of one antenna, so that which of the two is late nobody can say."""
    path = tmp_path_factory.mktemp("hidden") / "trip.mcap"
    late = {"yaw_rate": 0.6, "velocity": 0.6}
    hidden = Effects(clock_offset=late, yaw_rate_bias=0.2 * DEGREE)
    voyage = sail(500.0, seed=42, wind=Wind(2.0, 1.0), effects=hidden)
    write_voyage(path, voyage, seed=42, start=datetime(2026, 1, 1, tzinfo=UTC))
    return path


def test_ingest_corrects_on_demand_says_so_and_takes_it_back(log, tmp_path):
    folder, before = tmp_path / "store", log.read_bytes()

    def taken(*options):
        answer = tmp_path / "answer.json"
        code, _, _ = call("ingest", log, "--store", folder, *options, "--json", answer)
        assert code == 0
        (voyage,) = json.loads(answer.read_text())["voyages"]
        facts = json.loads((folder / "voyage=trip" / "voyage.json").read_text())
        (table,) = (t.collect() for t in Store(folder).tables(["trip"]))
        output = {(f["kind"], f["channel"]): f for f in voyage["findings"] if f["low"] is not None}
        return output, facts, table

    output, facts, table = taken()
    assert facts["corrected"] == []
    assert not any("Corrected" in f["sentence"] for f in output.values())

    findings_then, facts_then, table_then = taken("--correct")
    assert facts_then["fingerprint"] != facts["fingerprint"]
    done = {(c["kind"], c["channel"]): c for c in facts_then["corrected"]}
    assert set(done) == {("clock_offset", "yaw_rate"), ("yaw_rate_bias", "yaw_rate")}
    assert set(done["clock_offset", "yaw_rate"]) == {
        "kind", "channel", "value", "low", "high", "unit",
    }  # fmt: skip
    assert done["clock_offset", "yaw_rate"]["value"] == pytest.approx(0.6, abs=0.1)
    assert done["yaw_rate_bias", "yaw_rate"]["value"] == pytest.approx(0.2, abs=0.02)
    assert {
        key for key, f in findings_then.items() if f["sentence"].endswith(" Corrected.")
    } == set(done)
    assert set(findings_then) == set(output) == {*done, ("clock_offset", "velocity")}
    assert table_then["time"].equals(table["time"])
    assert left(table_then, VECTWIN) == {("clock_offset", "velocity")}

    assert taken("--correct")[2].equals(table_then)
    back = taken()
    assert back[1] == facts and back[2].equals(table)
    assert log.read_bytes() == before


def test_a_voyage_without_fault_is_left_as_it_is(tmp_path):
    voyage = sail(500.0, seed=31, wind=Wind(2.0, 1.0))
    write_voyage(tmp_path / "a.mcap", voyage, seed=31, start=datetime(2026, 1, 1, tzinfo=UTC))
    found = ingest(tmp_path / "a.mcap", VECTWIN)
    fixed = corrected(found)
    assert fixed.corrected == () and fixed.table.equals(found.table)
    assert fixed.report == found.report
    store = Store(tmp_path / "store")
    assert [store.add(found), store.add(fixed), store.add(fixed)] == [
        "added", "replaced", "unchanged",
    ]  # fmt: skip


def test_check_says_what_ingest_says_and_stores_nothing(log, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, _, _ = call("check", log, "--json", tmp_path / "c.json")
    (checked,) = json.loads((tmp_path / "c.json").read_text())["voyages"]
    assert code == 0
    assert {p.name for p in tmp_path.iterdir()} == {"c.json"}
    assert call("ingest", log, "--store", tmp_path / "s", "--json", tmp_path / "i.json")[0] == 0
    (taken,) = json.loads((tmp_path / "i.json").read_text())["voyages"]

    def parities(voyage):
        return [f for f in voyage["findings"] if f["channel"] in ("yaw_rate", "velocity")]

    assert len(parities(taken)) == 3
    assert parities(checked) == parities(taken)
    assert checked["rows"] == 0


def voyage_of(table, profile=BODY):
    """As ingest leaves it, of a table that no log was made for."""
    start = datetime(2026, 5, 1, tzinfo=UTC)
    stamps = [start + timedelta(milliseconds=100 * i) for i in range(table.height)]
    others = [pl.lit(0.0).alias(n) for n in (*profile.actuator_names, *profile.wind_names)]
    table = table.with_columns(time=pl.Series(stamps).cast(pl.Datetime("ns", "UTC")))
    table = table.with_columns(others)
    compared = compare(table, profile)
    report = VoyageReport("v", 1, 0, table.height, 1.0, compared.findings)
    return Voyage("v", profile, None, table, report, None, compared.estimates)


def estimate(kind, channel, value, half, none=0.0, unit="1"):
    return Estimate(kind, channel, value, value - half, value + half, none, 0.005, unit)


@pytest.mark.parametrize(
    ("one", "certain"),
    [
        (estimate("velocity_scale", "velocity", 1.04, 0.002, 1.0), True),
        (estimate("velocity_scale", "velocity", 1.944, 0.002, 1.0), False),  # knots
        (estimate("velocity_scale", "velocity", 0.5144, 0.002, 1.0), False),
        (estimate("velocity_scale", "velocity", 1.151, 0.002, 1.0), False),  # knots and mph
        (estimate("yaw_rate_scale", "yaw_rate", 0.1, 0.02, 1.0), False),  # the search's limit
        (estimate("yaw_rate_scale", "yaw_rate", 1.08, 0.005, 1.0), True),
        (estimate("clock_offset", "position", 1.0, 0.02, unit="s"), True),
        (estimate("clock_offset", "position", 4.79, 0.02, unit="s"), False),
    ],
)
def test_a_limit_or_a_unit_in_the_interval_is_a_question(one, certain):
    assert one.notable
    assert one.certain is certain and one.question is not certain


@pytest.mark.parametrize(
    "wrong",
    [
        lambda t: t.with_columns(pl.col("yaw_rate") / 60.0),  # deg/s called deg/min
        lambda t: t.with_columns(
            ((pl.col("heading").degrees() % 360.0 + np.pi) % (2 * np.pi) - np.pi).alias("heading")
        ),  # degrees called radians
        lambda t: t.with_columns(-pl.col("yaw_rate")),
        lambda t: t.with_columns(pl.col("surge", "sway") * 1.944),
    ],
    ids=["deg/min", "heading rad", "sign", "knots"],
)
def test_of_a_channel_that_contradicts_nothing_is_corrected(wrong):
    voyage = voyage_of(wrong(in_body_axes(3, seconds=500.0)))
    after = corrected(voyage)
    assert voyage.report.contradictions
    assert {e.channel for e in after.corrected} == set()
    assert after.table.equals(voyage.table)
    assert "Corrected." not in " ".join(f.sentence for f in after.report.findings)


def test_a_correction_that_makes_it_no_better_is_undone_and_that_is_said():
    voyage = voyage_of(in_body_axes(1, seconds=500.0, speed_scale=0.04))
    (scale,) = [e for e in voyage.estimates if e.certain]
    assert scale.kind == "velocity_scale"
    turned = replace(scale, value=0.9, low=0.899, high=0.901)  # the wrong way
    after = corrected(replace(voyage, estimates=(turned,)))
    assert after.corrected == () and after.table.equals(voyage.table)
    (said,) = [f.sentence for f in after.report.findings if f.kind == "velocity_scale"]
    assert said.endswith("Not corrected: the comparison is no better afterwards.")


def test_a_correction_after_which_two_contradict_is_undone():
    voyage = voyage_of(in_body_axes(1, seconds=500.0, speed_scale=0.04))
    (scale,) = [e for e in voyage.estimates if e.certain]
    wild = replace(scale, value=0.6, low=0.599, high=0.601)
    after = corrected(replace(voyage, estimates=(wild,)))
    assert after.corrected == () and after.table.equals(voyage.table)
    (said,) = [f.sentence for f in after.report.findings if f.kind == "velocity_scale"]
    assert "Not corrected: afterwards two channels contradict each other" in said


def test_what_is_certain_is_corrected_all_the_same():
    voyage = voyage_of(in_body_axes(1, seconds=500.0, speed_scale=0.04))
    after = corrected(voyage)
    assert [e.kind for e in after.corrected] == ["velocity_scale"]
    (said,) = [f.sentence for f in after.report.findings if f.kind == "velocity_scale"]
    assert said.endswith(" Corrected.")
