"""A ship that only knows where it is and where it points, from its log to 10 Hz rows."""

import numpy as np
import pytest
from sailing import PROFILE, RADIUS, SPEED, profile, series, stamps, write

from shiplog.logs.conversion.write import Series
from shiplog.nomenclature.channels import UNUSABLE
from shiplog.voyages.ingest.ingest import ingest
from shiplog.voyages.rows import recording
from shiplog.voyages.store.store import Store

NOISE_M, NOISE_DEG = 0.005, 0.1


def without(text, *sections):
    """A profile without some of its sections."""
    kept, skip = [], False
    for line in text.splitlines():
        if line.startswith("["):
            skip = line.strip("[]") in sections
        if not skip:
            kept.append(line)
    return "\n".join(kept)


POSE = without(PROFILE, "sensors.velocity", "sensors.yaw_rate", "sensors.wind")


def noisy(seconds=120.0):
    """The circle's position and heading with noise; its other instruments as they are."""
    rng, parts = np.random.default_rng(5), series(seconds)
    for topic, sigma in (("/position", NOISE_M), ("/gyro", NOISE_DEG)):
        for name, values in parts[topic].columns.items():
            parts[topic].columns[name] = values + sigma * rng.normal(size=len(values))
    return {t: one for t, one in parts.items() if t not in ("/velocity", "/wind")}


def voyage(tmp_path, parts, text=POSE):
    return ingest(write(tmp_path / "circle.mcap", parts), profile(text))


def usable(found, name):
    good = (found.table["quality"].to_numpy() & int(UNUSABLE)) == 0
    return found.table[name].to_numpy()[good]


def test_velocities_at_midship_are_the_circles_within_what_is_stated(tmp_path):
    found = voyage(tmp_path, noisy())
    stated = {one.channel: one for one in found.report.derived}
    assert {one.of for one in stated.values()} == {"position", "heading"}
    true = {"surge": SPEED, "sway": 0.0, "yaw_rate": np.degrees(SPEED / RADIUS)}
    for name, at in true.items():
        off = usable(found, name) * (np.degrees(1.0) if name == "yaw_rate" else 1.0) - at
        assert len(off) > 1100
        # of a steady motion all rows have one error: three deviations are one chance in 300
        assert np.sqrt(np.mean(off**2)) < 3.0 * stated[name].sigma
    assert stated["surge"].sigma < 0.1 * np.sqrt(2.0) * NOISE_M / 0.2  # of a plain difference


def test_samples_at_a_high_rate_are_averaged_and_their_own_noise_is_stated(tmp_path):
    """At 100 Hz, four at a time: σ of the mean is half that of one."""
    time = np.arange(0.0, 60.0, 0.01)
    rng, psi = np.random.default_rng(8), 3.0 + SPEED / RADIUS * np.arange(0.0, 60.0, 0.01)
    columns = {
        "x_m": RADIUS * np.sin(psi) + 0.7 * np.cos(psi) + 0.2 * np.sin(psi),
        "y_m": -RADIUS * np.cos(psi) + 0.7 * np.sin(psi) - 0.2 * np.cos(psi),
    }
    parts = noisy(60.0)
    noisy_columns = {n: v + NOISE_M * rng.normal(size=len(v)) for n, v in columns.items()}
    parts["/position"] = Series("/position", "test.Position", stamps(time), noisy_columns)
    found = voyage(tmp_path, parts)
    stated = {one.channel: one for one in found.report.derived}
    assert stated["surge"].sample_sigma == pytest.approx(0.01, rel=0.1)  # `sigma` of the profile
    assert np.abs(usable(found, "surge") - SPEED).max() < 5.0 * stated["surge"].sigma


def test_a_gyro_that_is_there_is_read_and_not_derived(tmp_path):
    text = without(PROFILE, "sensors.velocity", "sensors.wind")
    found = voyage(tmp_path, noisy(), text)
    assert [one.channel for one in found.report.derived] == ["surge", "sway"]
    assert found.profile.sensors.derived == ("surge", "sway")


@pytest.mark.parametrize("written", ["zero", "again"])
def test_a_lost_motion_capture_is_blank_and_said(tmp_path, written):
    """Position and heading in one message, as motion capture sends them: lost for 20 samples, and
    for one."""
    text = POSE.replace('topic = "/gyro"', 'topic = "/position"').replace(
        'field = "heading_deg"\nunit = "deg"', 'field = "yaw_rad"\nunit = "rad"'
    )
    parts = noisy()
    pose, heading = parts["/position"].columns, parts.pop("/gyro").columns["heading_deg"]
    columns = {**pose, "yaw_rad": np.radians(heading)}
    for first, last in ((300, 320), (700, 701)):
        for name in columns:
            columns[name][first:last] = 0.0 if written == "zero" else columns[name][first - 1]
    parts["/position"] = Series("/position", "test.Pose", parts["/position"].time, columns)
    found = voyage(tmp_path, parts, text)
    said = [f for f in found.report.findings if f.kind == "not_available"]
    assert {f.channel for f in said} == {"position", "heading"}
    assert all(f.value == 21.0 for f in said)
    assert "lost its markers" in said[0].sentence
    rows = found.table.with_row_index()["x0"].is_null().to_numpy()
    assert rows[301:319].all()
    assert rows.sum() < 60
    assert np.abs(usable(found, "surge") - SPEED).max() < 0.05


def test_an_instrument_at_rest_that_repeats_itself_is_no_lost_one(tmp_path):
    """A ship alongside for half a minute, without noise, then under way."""
    parts = noisy()
    for topic in ("/position", "/gyro"):
        for name, values in parts[topic].columns.items():
            parts[topic].columns[name] = np.concatenate((np.full(300, values[0]), values[:-300]))
    found = voyage(tmp_path, parts)
    assert not [f for f in found.report.findings if f.kind == "not_available"]


def test_a_position_that_steps_begins_a_new_segment_and_bends_no_velocity(tmp_path):
    parts = noisy()
    parts["/position"].columns["x_m"][600:] += 5.0
    found = voyage(tmp_path, parts)
    (jump,) = [f for f in found.report.findings if f.kind == "jump"]
    assert jump.channel == "position"
    assert jump.value == pytest.approx(5.0, abs=0.2)
    assert np.abs(usable(found, "surge") - SPEED).max() < 0.05


@pytest.mark.parametrize("mirrored", [False, True])
def test_an_axis_counted_to_port_is_told_by_the_heading_alone(tmp_path, mirrored):
    """As of a capture whose z points upwards: the way turns to port, the heading to starboard."""
    parts = noisy(300.0)
    parts["/position"].columns["y_m"] *= -1.0 if mirrored else 1.0
    text = POSE.replace("lever_arm_m = [0.7, -0.2]", "lever_arm_m = [0.0, 0.0]")
    found = voyage(tmp_path, parts, text)
    clashes = found.report.contradictions
    assert len(clashes) == mirrored
    if mirrored:
        assert "position is mirrored" in clashes[0].sentence
        assert "sign = [1.0, -1.0] on [sensors.position]" in clashes[0].sentence


def test_no_diagnosis_counts_a_derived_channel(tmp_path):
    from shiplog.diagnosis.linear import segments

    found = voyage(tmp_path, noisy())
    record = recording.read([found.table], ["circle"], found.profile)
    _, used = segments.measured(record, segments.begins(record))
    assert used[..., [0, 2, 4]].any()
    assert not used[..., [1, 3, 5]].any()


def test_the_store_keeps_what_was_derived(tmp_path):
    found = voyage(tmp_path, noisy())
    store = Store(tmp_path / "store")
    store.add(found)
    assert store.report("circle").derived == found.report.derived
    assert store.profile(["circle"]).sensors.velocity is None


def test_a_table_without_velocity_is_drafted_converted_and_ingested(tmp_path):
    import polars as pl

    from shiplog.commands.convert import convert
    from shiplog.drafting.tables import draft_table
    from shiplog.ship_profile import file as profiles

    time = np.arange(0.0, 120.0, 0.1)
    heading = 3.0 + SPEED / RADIUS * time
    rng = np.random.default_rng(6)
    table = pl.DataFrame({
        "time_s": time, "x0_m": RADIUS * np.sin(heading) + NOISE_M * rng.normal(size=len(time)),
        "y0_m": -RADIUS * np.cos(heading) + NOISE_M * rng.normal(size=len(time)),
        "heading_deg": np.degrees(heading) % 360.0, "rudder_deg": 10.0 * np.sin(0.2 * time),
        "rpm": 300.0 + 10.0 * np.sin(0.1 * time),
    })  # fmt: skip
    table.write_csv(tmp_path / "trip.csv")
    text = draft_table(tmp_path / "trip.csv")
    assert "# No velocity was recognised; shiplog does without it" in text
    chosen = profiles.parse(text, "trip.toml")
    convert([tmp_path / "trip.csv"], chosen, tmp_path / "logs")
    found = ingest(tmp_path / "logs" / "trip.mcap", chosen)
    assert np.median(usable(found, "surge")) == pytest.approx(SPEED, abs=0.01)
    assert found.report.derived
