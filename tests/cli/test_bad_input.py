"""What a user can get wrong, one row each: a sentence, the right exit code, never a traceback.

Logs, profiles, tables, options and folders; `test_bad_runs` has what needs a trained run.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

import numpy as np
import pytest
import sailing
from command_desk import PROFILE, TABLE, Desk, judge
from mcap.reader import make_reader

from shiplog import cli


def halves(desk: Desk) -> bytes:
    raw = desk.log.read_bytes()
    return raw[: len(raw) // 2]


def flipped(desk: Desk, place: str) -> Path:
    """A log of two chunks with one byte changed in the first, or in the index behind it."""
    path = sailing.write(desk.path("a.mcap"), sailing.series(600.0))
    with path.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary and len(summary.chunk_indexes) > 1
    first = min(summary.chunk_indexes, key=lambda index: index.chunk_start_offset)
    end = first.chunk_start_offset + first.chunk_length
    raw = bytearray(path.read_bytes())
    raw[end - first.compressed_size // 2 if place == "chunk" else end + 40] ^= 0xFF
    return desk.file("a.mcap", bytes(raw))


def short(desk: Desk, seconds: float) -> Path:
    return sailing.write(desk.path("short.mcap"), sailing.series(seconds))


def without(desk: Desk, value: float) -> Path:
    """The good voyage whose velocity is `value` all along."""
    parts = sailing.series(30.0)
    parts["/velocity"].columns["sog_kn"][:] = value
    return sailing.write(desk.path("empty.mcap"), parts)


def two_ships(desk: Desk) -> Path:
    """A store in which a second ship has a voyage of the first one's name scheme."""
    store = desk.path("both")
    for log, name in ((desk.log, "circle"), (desk.log.with_name("two.mcap"), "square")):
        profile = desk.profile('name = "circle"', f'name = "{name}"')
        assert cli.run([str(a) for a in (
            "ingest", log, "--profile", profile, "--store", store)]) == 0  # fmt: skip
    return store


def undriven(desk: Desk) -> Path:
    """A store whose profile has no actuator."""
    profile = desk.file("p.toml", PROFILE[: PROFILE.index("[[actuators]]")])
    arguments = ("ingest", desk.log, "--profile", profile, "--store", desk.path("drift"))
    assert cli.run([str(a) for a in arguments]) == 0
    return desk.path("drift")


LOGS = {
    "ingest: no such log": (1, ["does not exist"], lambda d: d.ingest("nowhere.mcap")),
    "check: no such log": (1, ["does not exist"], lambda d: ["check", "nowhere.mcap"]),
    "profile: no such log": (1, ["does not exist"], lambda d: ["profile", "nowhere.mcap"]),
    "0 bytes": (1, ["is empty (0 bytes)"], lambda d: d.ingest(d.file("a.mcap"))),
    "check: 0 bytes": (1, ["is empty (0 bytes)"], lambda d: ["check", d.file("a.mcap")]),
    "text renamed": (1, ["is no MCAP log"], lambda d: d.ingest(d.file("a.mcap", "hello you all"))),
    "line ends converted": (1, ["copy the original again in binary mode"],
                            lambda d: d.ingest(d.file("a.mcap", b"\x89MCAP0\n\n" + b"x" * 99))),
    "cut within the magic": (1, ["cut off after 4 bytes"],
                             lambda d: d.ingest(d.file("a.mcap", b"\x89MCA"))),
    "only the magic": (1, ["a.mcap"], lambda d: d.ingest(d.file("a.mcap", b"\x89MCAP0\r\n"))),
    "rubbish behind the magic": (1, ["a.mcap"], lambda d: d.ingest(
        d.file("a.mcap", b"\x89MCAP0\r\n" + bytes(range(256)) * 9))),
    "cut in half": (3, ["cut off"], lambda d: d.ingest(
        d.file("a.mcap", halves(d)), "--profile", d.profile())),
    "check: cut in half": (3, ["cut off"], lambda d: ["check", d.file("a.mcap", halves(d))]),
    "a byte in a chunk": (3, ["before the first message that can be read are lost"],
        lambda d: d.ingest(flipped(d, "chunk"), "--profile", d.profile())),
    "check: a byte in a chunk": (3, ["lost"], lambda d: ["check", flipped(d, "chunk")]),
    "a byte in an index": (0, ["36000 messages read, 0 lost"], lambda d: d.ingest(
        flipped(d, "index"), "--profile", d.profile())),
    "one sample": (1, ["usable heading sample(s)"], lambda d: d.ingest(
        short(d, 0.1), "--profile", d.profile())),
    "one second": (0, ["of which 0 s can be used"], lambda d: d.ingest(
        short(d, 1.0), "--profile", d.profile())),
    "a velocity of NaN": (0, ["velocity is blank", "of which 0 s can be used"],
        lambda d: d.ingest(without(d, np.nan), "--profile", d.profile())),
    "a velocity of inf": (0, ["velocity is blank", "of which 0 s can be used"],
        lambda d: d.ingest(without(d, np.inf), "--profile", d.profile())),
    "profile: text": (1, ["is no MCAP log"], lambda d: ["profile", d.file("a.mcap", "hello you")]),
    "profile: a folder": (1, ["holds no table"], lambda d: ["profile", d.dir("logs")]),
    "an empty folder": (1, ["is a folder without MCAP logs"], lambda d: d.ingest(d.dir("logs"))),
    "check: an empty folder": (1, ["without MCAP logs"], lambda d: ["check", d.dir("logs")]),
    "an empty folder and a log": (3, ["without MCAP logs"], lambda d: d.ingest(
        d.dir("logs"), d.log, "--profile", d.profile())),
    "a good log and a bad one": (3, ["bad.mcap refused"], lambda d: d.ingest(
        d.log, d.file("bad.mcap", "hello you"), "--profile", d.profile())),
    "a good log and none": (3, ["nowhere.mcap refused"], lambda d: d.ingest(
        d.log, "nowhere.mcap", "--profile", d.profile())),
    "a Parquet table": (1, ["shiplog convert"], lambda d: d.ingest(d.table("t.parquet"))),
    "a CSV table": (1, ["shiplog convert"], lambda d: ["check", d.table("t.csv")]),
    "a name taken by another log": (1, ["already holds another log"], lambda d: [
        "ingest", d.file("one.mcap", (d.log.parent / "two.mcap").read_bytes()), "--profile",
        d.profile(), "--store", d.store]),
    "a name too long for a folder": (1, ["too long for a folder"], lambda d: d.ingest(
        d.file("a" * 245 + ".mcap", d.log.read_bytes()), "--profile", d.profile())),
    "a log of nobody's profile": (1, ["shiplog profile"], lambda d: d.ingest(d.log)),
}  # fmt: skip
PROFILES = {
    "unknown": (1, ["did you mean 'esso-osaka'"],
                lambda d: d.ingest(d.log, "--profile", "esso-osak")),
    "check: unknown": (1, ["no profile named"],
                       lambda d: ["check", d.log, "--profile", "flying-dutchman"]),
    "convert: unknown": (1, ["no profile named"], lambda d: d.convert(d.table(), profile="ship")),
    "no file": (1, ["no profile file"], lambda d: d.ingest(d.log, "--profile", "nowhere.toml")),
    "a folder": (1, ["is a folder"], lambda d: d.ingest(d.log, "--profile", d.folder)),
    "of another ship": (1, ["has no topic"], lambda d: d.ingest(d.log, "--profile", "blueboat")),
    "bad TOML": (1, ["not valid TOML", "line 2"], lambda d: d.through("[ship]", "[ship")),
    "not UTF-8": (1, ["UTF-8"], lambda d: d.ingest(
        d.log, "--profile", d.file("p.toml", b"\xff\xfe[ship]"))),
    "empty": (1, ["ship is missing"], lambda d: d.ingest(d.log, "--profile", d.file("p.toml"))),
    "6000 digits": (1, ["not valid TOML"],
        lambda d: d.through("[ship]", f"x = {'9' * 6000}\n[ship]")),
    "20 000 brackets": (1, ["not valid TOML"], lambda d: d.through(
        "[ship]", f"x = {'[' * 20_000}{']' * 20_000}\n[ship]")),
    "unknown key": (1, ["did you mean 'length_m'"], lambda d: d.through("length_m", "lenght_m")),
    "no position": (1, ["sensors.position is missing"],
                    lambda d: d.through("[sensors.position]", "[sensors.positn]")),
    "unknown section": (1, ["did you mean 'sensors'"],
                        lambda d: d.through("[sensors.wind]", "[sensor.wind]")),
    "no heading": (1, ["sensors.heading is missing"],
                   lambda d: d.through("[sensors.heading]", "[sensors.wind2]")),
    "wrong kind of sensor": (1, ["it can be geodetic, local"],
                             lambda d: d.through('kind = "local"', 'kind = "polar"')),
    "wrong kind of actuator": (1, ["actuators.0.kind"],
                               lambda d: d.through('kind = "rudder"', 'kind = "oar"')),
    "wrong clock": (1, ["sensors.heading.clock"], lambda d: d.through(
        'field = "heading_deg"', 'clock = "church"\nfield = "heading_deg"')),
    "one field for two": (1, ["needs 2 field(s)"],
                          lambda d: d.through('fields = ["x_m", "y_m"]', 'field = "x_m"')),
    "unknown unit": (1, ["furlong"], lambda d: d.through('unit = "rpm"', 'unit = "furlong"')),
    "unknown field": (1, ["did you mean 'heading_deg'"],
                      lambda d: d.through('"heading_deg"', '"heading_dge"')),
    "unknown topic": (1, ["has no topic"], lambda d: d.through('"/rudder"', '"../../etc/passwd"')),
    "negative length": (1, ["ship.length_m has to be greater than or equal to 0.1"],
        lambda d: d.through("length_m = 3.0", "length_m = -3")),
    "length inf": (1, ["finite"], lambda d: d.through("length_m = 3.0", "length_m = inf")),
    "length in words": (1, ["ship.length_m"], lambda d: d.through("= 3.0", "= 'three'")),
    "lever arm NaN": (1, ["finite"], lambda d: d.through("= [0.7, -0.2]", "= [nan, 0.0]")),
    "a ship of 30 km": (1, ["ship.length_m", "less than or equal to 1000"],
                        lambda d: d.through("length_m = 3.0", "length_m = 30_000.0")),
    "lever arm of 10 km": (1, ["lever_arm_m", "less than or equal to 1000"],
                           lambda d: d.through("= [0.7, -0.2]", "= [1e4, 0.0]")),
    "sign 0": (1, ["`sign` is 0"], lambda d: d.through(
        'field = "heading_deg"', 'sign = 0.0\nfield = "heading_deg"')),
    "scale 1e308": (1, ["sensors.heading: `sign` is -1e+308", "between 1e-12 and 1e+06"],
        lambda d: d.through('field = "heading_deg"', 'sign = -1e308\nfield = "heading_deg"')),
    "offset 1e308": (1, ["sensors.heading.offset"], lambda d: d.through(
        'field = "heading_deg"', 'offset = 1e308\nfield = "heading_deg"')),
    "water of 1 kg/m³, 3 m above ground": (1, ["site.density", "site.depth_m", "site.datum.0"],
        lambda d: d.through("[ship]", "[site]\ndensity = 1.0\ndepth_m = -3.0\ndatum = [100.0, 2.0]"
                            "\n[ship]")),
    "sigma negative": (1, ["greater than or equal to 0"],
                       lambda d: d.through("sigma = 0.05", "sigma = -0.05")),
    "limits reversed": (1, ["the lower one stands first"],
                        lambda d: d.through("[-35.0, 35.0]", "[35.0, -35.0]")),
    "actuator's name a path": (1, ["letters, digits and underscores"],
                               lambda d: d.through('"rudder"\nkind', '"../../x"\nkind')),
    "actuator's name taken": (1, ["already taken: rudder"],
                              lambda d: d.through('"propeller"\nkind', '"rudder"\nkind')),
    "table's channel unknown": (1, ["the channel 'speed'"],
                                lambda d: d.through("[ship]", "[table]\nu = 'speed'\n[ship]")),
}  # fmt: skip
TABLES = {
    "no such table": (1, ["does not exist"], lambda d: d.convert("nowhere.csv")),
    "no table": (1, ["is no table"], lambda d: d.convert(d.file("t.xlsx", b"PK"))),
    "rubbish Parquet": (1, ["cannot be read"], lambda d: d.convert(d.file("t.parquet", b"PAR1x"))),
    "empty CSV": (1, ["is no table"], lambda d: d.convert(d.file("t.csv"))),
    "no rows": (1, ["no row"], lambda d: d.convert(d.file("t.csv", ",".join(TABLE) + "\n"))),
    "no time in any row": (1, ["no row"], lambda d: d.convert(d.table(t_s=[None] * 3))),
    "a column missing": (1, ["no column for heading"], lambda d: d.convert(d.file(
        "t.csv", "t_s,run_id,x0_m,y0_m,u_body_mps,v_body_mps,r_degps,delta_deg,n_rps\n"
        "0,a,0,0,0,0,0,0,0\n"))),
    "words in a number column": (1, ["'u_body_mps' holds no number, but 'fast'"],
        lambda d: d.convert(d.table(u_body_mps=["fast"] * 3))),
    "a folder without tables": (1, ["holds no table"], lambda d: d.convert(d.dir("topics"))),
    "a profile without [table]": (1, ["has no [table] section"],
                                  lambda d: d.convert(d.table(), profile=d.profile())),
    "a good table and a bad one": (3, ["bad.csv refused"], lambda d: d.convert(
        d.table(), d.file("bad.csv", "a,b\n1,2\n"))),
    "a voyage that is there already": (3, ["t.csv: z1 refused", "exists already", "1 log in"],
        lambda d: [*d.convert(d.table(run_id=["z1", "z1", "z2"]))[:-1],
                   d.file("z1.mcap").parent]),
    "two voyages of one file name": (3, ["2 logs in", "t.csv: a_1 refused: Two voyages of t.csv",
        "another name in the table"],
        lambda d: d.convert(d.table(run_id=["a/1", "a:1", "z"]))),
    "a log that is there already": (1, ["exists already"], lambda d: [
        *d.convert(d.table())[:-1], d.file("z1.mcap").parent]),
}  # fmt: skip
OPTIONS = {
    "no such command": (2, ["No such command"], lambda d: ["sail"]),
    "no such option": (2, ["No such option"], lambda d: d.train("--speed", "10")),
    "ingest without logs": (2, ["Missing argument"], lambda d: ["ingest"]),
    "train without --out": (2, ["--out"], lambda d: ["train"]),
    "convert without profile": (1, ["only a profile says"], lambda d: [
        "convert", d.table(), "--out", d.path("x")]),
    "--seeds -1": (2, ["--seeds"], lambda d: d.train("--seeds", "-1")),
    "--seeds three": (2, ["--seeds"], lambda d: d.train("--seeds", "three")),
    "--window 5": (2, ["--window", "greater than or equal to 6"],
                   lambda d: d.train("--window", "5")),
    "--width 0": (2, ["--width"], lambda d: d.train("--width", "0")),
    "--epochs 0": (2, ["--epochs"], lambda d: d.train("--epochs", "0")),
    "--folds -1": (2, ["--folds"], lambda d: d.train("--folds", "-1")),
    "--model": (2, ["--model can be feedforward, hybrid, mmg"],
        lambda d: d.train("--model", "lstm")),
    "--data": (2, ["did you mean 'sli"], lambda d: d.train("--data", "sli99")),
    "--recipe": (2, ["--recipe can be fast, paper"], lambda d: d.train("--recipe", "quick")),
    "--wind-input": (2, ["--wind-input can be"], lambda d: d.train("--wind-input", "sails")),
    "--device": (2, ["--device can be cpu, cuda"], lambda d: d.train("--device", "tpu")),
    "--device for the fast recipe": (2, ["add --recipe paper"],
                                     lambda d: d.train("--device", "cuda")),
    "--device of a physical model": (2, ["says nothing to a physical model"], lambda d: d.train(
        "--model", "mmg", "--device", "cuda", "--recipe", "paper")),
    "a GPU and processes": (2, ["--jobs says nothing to --device cuda"], lambda d: [
        "paper", "--store", d.store, "--device", "cuda", "--recipe", "paper", "--jobs", "2"]),
    "processes and a cluster": (2, ["--jobs says nothing to --ray"], lambda d: [
        "paper", "--store", d.store, "--jobs", "2", "--ray", "a:1"]),
    "--web and --save": (2, ["--web serves", "leave one of them out"], lambda d: [
        "compare", "runs/mmg", "--web", "--save", d.path("a.rrd")]),
    "a GPU and a cluster": (2, ["--ray says nothing to --device cuda"], lambda d: [
        "paper", "--store", d.store, "--device", "cuda", "--recipe", "paper", "--ray", "a:1"]),
    "--no-fit of a network": (2, ["says nothing to a network"], lambda d: d.train("--no-fit")),
    "--parameters of a network": (2, ["says nothing"], lambda d: d.train("--parameters", "x.toml")),
    "--without of a network": (2, ["says nothing"], lambda d: d.train("--without", "wind")),
    "--free of a network": (2, ["says nothing"], lambda d: d.train("--free", "wind.*")),
    "--folds of a network": (2, ["says nothing"], lambda d: d.train("--folds", "2")),
    "--no-fit of a hybrid": (2, ["has to be fitted"],
                             lambda d: d.train("--model", "hybrid", "--no-fit")),
    "noisy copies for mmg": (2, ["choose ref or d-ref"],
                             lambda d: d.train("--model", "mmg", "--data", "jit2")),
    "overlapping windows for mmg": (2, ["windows that overlap", "choose ref or d-ref"],
                                    lambda d: d.train("--model", "mmg", "--data", "sli10")),
    "unknown voyage": (1, ["did you mean 'one'"], lambda d: d.train("--voyages", "onne")),
    "unknown validation": (1, ["No voyage matches 'x*'"], lambda d: d.train("--validation", "x*")),
    "one voyage for both": (1, ["also a validation voyage"], lambda d: d.train(
        "--voyages", "one", "--validation", "one", "--window", "20")),
    "a window longer than the voyages": (1, ["--window"], lambda d: d.train("--window", "900")),
    "one voyage, too short to be split": (1, ["the only voyage", "choose --window 9 or shorter"],
        lambda d: d.train("--voyages", "one", "--window", "40")),
    "a profile without actuators": (1, ["actuator"], lambda d: [
        "train", "--store", undriven(d), "--out", d.path("run")]),
    "--extend where the report goes": (2, ["--extend runs/mmg2 is a folder for a run"], lambda d: [
        "diagnose", "runs/mmg", "--out", "runs/mmg2", "--extend", "runs/mmg2"]),
    "--extend above the report": (2, ["--extend a is a folder for a run"], lambda d: [
        "diagnose", "runs/mmg", "--out", "a/b/../c", "--extend", "a"]),
    "--out of a begun run": (2, ["leave .partial out"], lambda d: [
        "train", "--store", d.store, "--out", d.path("run.partial")]),
    "--extend of a begun run": (2, ["leave .partial out"], lambda d: [
        "diagnose", "runs/mmg", "--out", "a", "--extend", d.path("run.partial")]),
    "two ships": (1, ["different ships"], lambda d: ["train", "--store", two_ships(d), "--out",
        d.path("run")]),
}  # fmt: skip
FOLDERS = {
    "ingest: the store is a file": (1, ["is a file"], lambda d: [
        "ingest", d.log, "--profile", d.profile(), "--store", d.file("s")]),
    "ingest: the store in a file": (1, ["is a file"], lambda d: [
        "ingest", d.log, "--profile", d.profile(), "--store", d.file("s") / "store"]),
    "ingest: the store cannot be made": (1, ["/proc/shiplog"], lambda d: [
        "ingest", d.log, "--profile", d.profile(), "--store", "/proc/shiplog"]),
    "train: --out cannot be made": (1, ["/proc/"], lambda d: [
        "train", "--store", d.store, "--out", "/proc/shiplog", "--window", "6"]),
    "convert: --out cannot be made": (1, ["/proc/shiplog"], lambda d: [
        "convert", d.table(), "--profile", "kvlcc2", "--out", "/proc/shiplog"]),
    "--json cannot be written": (1, ["/proc/a.json"], lambda d: [
        "voyages", "--store", d.store, "--json", "/proc/a.json"]),
    "voyages: the store is a file": (1, ["is a file"],
        lambda d: ["voyages", "--store", d.file("s")]),
    "voyages: no store": (1, ["no store"], lambda d: ["voyages", "--store", d.path("s")]),
    "train: the store is a file": (1, ["is a file"], lambda d: [
        "train", "--store", d.file("s"), "--out", d.path("run")]),
    "train: no store": (1, ["ingest logs first"], lambda d: [
        "train", "--store", d.path("s"), "--out", d.path("run")]),
    "train: an empty store": (1, ["ingest logs first"], lambda d: [
        "train", "--store", d.dir("s"), "--out", d.path("run")]),
    "train: --out is there": (1, ["exists already"], lambda d: [
        "train", "--store", d.store, "--out", d.dir("run")]),
    "train: --out in a file": (1, ["--out", "is a file"], lambda d: [
        "train", "--store", d.store, "--out", d.file("runs") / "run"]),
    "train: --out too long": (1, ["too long"], lambda d: [
        "train", "--store", d.store, "--out", d.path("r" * 300)]),
    "convert: --out in a file": (1, ["--out", "is a file"], lambda d: [
        "convert", d.table(), "--profile", "kvlcc2", "--out", d.file("f") / "logs"]),
    "profile: --out is there": (1, ["exists already"], lambda d: [
        "profile", d.log, "--out", d.file("p.toml")]),
    "profile: --out in no folder": (1, ["there is no folder"], lambda d: [
        "profile", d.log, "--out", d.path("none") / "p.toml"]),
    "--json a folder": (1, ["it is a folder"], lambda d: [
        "voyages", "--store", d.store, "--json", d.folder]),
    "--json in no folder": (1, ["there is no folder"], lambda d: [
        "voyages", "--store", d.store, "--json", d.path("none") / "a.json"]),
    "--json of an empty variable": (2, ["--json is given no path"], lambda d: [
        "voyages", "--store", d.store, "--json", ""]),
    "--json in a file": (1, ["is a file"], lambda d: [
        "check", d.log, "--json", d.file("f") / "a.json"]),
    "demo: no logs": (1, ["No log in"], lambda d: ["demo", "--logs", d.dir("logs")]),
    "demo: no such folder": (1, ["No log in"], lambda d: ["demo", "--logs", d.path("logs")]),
    "demo: --out is a file": (1, ["is a file"], lambda d: ["demo", "--out", d.file("f")]),
}  # fmt: skip
CASES = [
    pytest.param(*case, id=f"{table}: {name}")
    for table, cases in (
        ("log", LOGS), ("profile", PROFILES), ("table", TABLES), ("option", OPTIONS),
        ("folder", FOLDERS),
    )
    for name, case in cases.items()
]  # fmt: skip


@pytest.mark.parametrize(("code", "words", "arguments"), CASES)
def test_it_is_one_sentence_and_the_right_code(desk, capsys, code, words, arguments):
    judge(arguments(desk), code, words, capsys)


def test_nothing_is_left_of_what_was_refused(desk, capsys):
    """Neither a store, nor a run, nor logs."""
    for arguments in (
        desk.ingest(desk.file("a.mcap")), desk.train("--model", "lstm"), desk.train("--data", "x"),
        desk.convert(desk.table(u_body_mps=["fast"] * 3)),
    ):  # fmt: skip
        assert cli.run([str(a) for a in arguments]) in (1, 2)
    capsys.readouterr()
    assert {p.name for p in desk.folder.iterdir()} <= {"a.mcap", "t.csv", "cache"}


def test_refused_logs_are_in_the_json(desk, capsys):
    import json

    bad = desk.file("bad.mcap", "hello you")
    arguments = [*desk.ingest(desk.log, bad, "--profile", desk.profile()), "--json",
                 desk.path("a.json")]  # fmt: skip
    judge(arguments, 3, ["bad.mcap"], capsys)
    answer = json.loads(desk.path("a.json").read_text())
    assert [v["name"] for v in answer["voyages"]] == ["one"]
    ((path, why),) = answer["refused"].items()
    assert path == str(bad) and "is no MCAP log" in why
    judge(["check", bad, "--json", desk.path("b.json")], 1, ["bad.mcap"], capsys)
    assert list(json.loads(desk.path("b.json").read_text())["refused"]) == [str(bad)]


@pytest.mark.skipif(sys.platform != "linux", reason="other systems have names of text only")
def test_a_log_whose_name_is_no_text(desk, capsys):
    path = os.fsencode(desk.folder) + b"/\xff\xfe.mcap"
    Path(os.fsdecode(path)).write_bytes(desk.log.read_bytes())
    arguments = desk.ingest(Path(os.fsdecode(path)), "--profile", desk.profile())
    judge(arguments, 1, ["is not text"], capsys)
