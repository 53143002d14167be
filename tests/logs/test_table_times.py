"""The times of a table, in every form in which they stand there."""

import re
import tomllib
from datetime import datetime

import numpy as np
import polars as pl
import pytest
from test_conversion import PROFILE

from shiplog.commands.convert import convert
from shiplog.exceptions import ProfileError
from shiplog.logs.conversion import clock
from shiplog.logs.decoding import fields
from shiplog.logs.reading.read import read
from shiplog.ship_profile import file as profiles

NOON = 1_617_969_600_000_000_000  # 2021-04-09 12:00:00 UTC, ns


@pytest.mark.parametrize(
    ("values", "unit"),
    [
        (["2021-04-09T12:00:00Z", "2021-04-09T12:00:00.500Z"], None),
        (["2021-04-09T14:00:00+02:00", "2021-04-09T14:00:00.5+02:00"], None),
        (["2021-04-09 12:00:00", "2021-04-09 12:00:00.5"], None),
        (["2021/04/09 12:00:00", "2021/04/09 12:00:00.5"], None),
        (["09.04.2021 12:00:00", "09.04.2021 12:00:00.5"], None),
        ([1617969600, 1617969600.5], None),
        ([1617969600000, 1617969600500], None),
        ([1617969600000000, 1617969600500000], None),
        ([NOON, NOON + 500_000_000], None),
        (["1617969600,0", "1617969600,5"], None),
        ([1617969600 / 60, 1617969600.5 / 60], "min"),
    ],
)
def test_a_time_is_itself_in_every_form(values, unit):
    found = clock.instants(pl.Series("t", values, strict=False), unit)
    # A float of seconds or minutes holds this century to a fraction of a microsecond.
    assert (found - pl.Series([NOON, NOON + 500_000_000])).abs().max() <= 5_000


@pytest.mark.parametrize("end", ["\0\0\0", "END OF RECORD"])
def test_a_word_among_times_costs_its_row_alone(tmp_path, end):
    """A logger that lost its power, or a last line in words: as ISO texts have it, too."""
    found = clock.instants(pl.Series("t", ["0.0", "0.1", "0.2", end])).to_list()
    assert found == [0, 10**8, 2 * 10**8, None]
    names = [*profiles.parse(PROFILE, "m").table]
    rows = [",".join(str(0.1 * i) for _ in names) for i in range(3)]
    (tmp_path / "t.csv").write_text("\n".join([",".join(names), *rows, end]))
    done = convert([tmp_path / "t.csv"], profiles.parse(PROFILE, "m"), tmp_path / "out")
    assert not done.refused and len(done.logs) == 1


def test_datetimes_keep_their_instant_and_count_from_start_keep_theirs():
    noon = datetime(2021, 4, 9, 12)
    assert clock.instants(pl.Series([noon])).to_list() == [NOON]
    zoned = pl.Series([noon]).dt.replace_time_zone("Europe/Oslo")
    assert clock.instants(zoned).to_list() == [NOON - 2 * 3600 * 10**9]
    assert clock.instants(pl.Series([0.0, 0.1, 0.25])).to_list() == [0, 10**8, 25 * 10**7]


def test_a_time_of_day_goes_on_past_midnight():
    found = clock.instants(pl.Series("t", ["23:59:59.5", "00:00:00.5"]))
    assert found.diff().to_list()[1] == 10**9


@pytest.mark.parametrize(
    "before", [[], ["23:59:58.0"]], ids=["begins at midnight", "the day before"]
)
def test_a_late_row_from_before_midnight_moves_no_later_row_by_a_day(before):
    rows = [*before, "00:00:00.2", "23:59:59.8", "00:00:00.4", "06:00:00.0", "20:00:00.0"]
    found = clock.instants(pl.Series("t", rows)).to_numpy()[-5:] * 1e-9
    wanted = [0.2, -0.2, 0.4, 6 * 3600.0, 20 * 3600.0]  # a gap of 14 h is one
    assert found - found[0] == pytest.approx(np.array(wanted) - wanted[0], abs=1e-6)


NMEA_DAY = [124758.5, 124759.5, 124800.5, 124801.5]


@pytest.mark.parametrize(
    ("values", "form"),
    [
        (NMEA_DAY, None), (["124758.50", "124759.50", "124800.50", "124801.50"], None),
        (NMEA_DAY, "%H%M%S"), (NMEA_DAY, "%H%M%S%.f"),
        ([19700101000000 + n for n in NMEA_DAY], "%Y%m%d%H%M%S"),
    ],
)  # fmt: skip
def test_hours_minutes_and_seconds_in_one_number_are_a_time_of_day(values, form):
    found = clock.instants(pl.Series("t", values), form=form).to_numpy()
    assert found * 1e-9 == pytest.approx(12 * 3600 + 47 * 60 + 58.5 + np.arange(4), abs=0.01)


def test_one_number_for_a_time_of_day_goes_on_past_midnight_and_keeps_its_zeros():
    found = clock.instants(pl.Series("t", [235958, 235959, 0, 1, 2]))
    assert found.diff().drop_nulls().to_list() == [10**9] * 4
    (early,) = clock.instants(pl.Series("t", [5]), form="%H%M%S")
    assert early == 5 * 10**9


@pytest.mark.parametrize(
    "seconds",
    [np.arange(0, 300), np.arange(500, 560), np.r_[0:50, 100:150], np.arange(100, 150, 0.1),
     np.arange(0, 600, 30), np.arange(81_000, 90_000)],
    ids=["five minutes", "one minute", "with a gap", "inside a minute", "every 30 s", "of a day"],
)  # fmt: skip
def test_seconds_from_any_start_stay_seconds(seconds):
    found = clock.instants(pl.Series("t", seconds)).to_numpy() * 1e-9
    assert found == pytest.approx(seconds, abs=1e-9)


DATED = 1_711_152_000  # 2024-03-23, s


@pytest.mark.parametrize(
    ("numbers", "second"),
    [([124759, 124800], 46_079), ([94759, 94760], 94_759 - 86_400), ([124750, 124751], 46_070),
     ([67, 68], 67), ([83_499, 83_500], 83_499), ([DATED + 50_000, DATED + 50_001], 50_000),
     (["124750.00", "124751.00"], 46_070), (["12:47:50", "12:47:51"], 46_070)],
    ids=["across a minute", "of the next day", "no second of a day", "soon after midnight",
         "second of the day", "Unix time", "text", "with colons"],
)  # fmt: skip
def test_a_number_beside_a_date_is_a_time_of_that_day(numbers, second):
    found = clock.of_day(pl.Series("t", [*numbers])) % clock.DAY_NS
    assert found.to_list() == [second * 10**9, (second + 1) * 10**9]


def test_a_logger_of_nmea_has_its_date_and_its_time_as_numbers(tmp_path):
    rows = [f"{t},230324,0,0,0,0,0" for t in (94758, 94759, 94800, 94801)]
    (tmp_path / "t.csv").write_text("\n".join(["t,day,x,y,psi,u,v", *rows]))
    profile = profiles.parse(PROFILE + 'day = "date"\n', "mine")
    (path,) = convert([tmp_path / "t.csv"], profile, tmp_path).logs
    stamps = read(path).frames["/gyro"]["stamp"].to_list()
    assert stamps == [(DATED + 9 * 3600 + 47 * 60 + 58 + n) * 10**9 for n in range(4)]


@pytest.mark.parametrize(
    ("numbers", "words"),
    [([83401, 83402, 83403], "can be seconds of it or hhmmss"),
     ([45_290_000, 45_290_050, 45_290_100], "are no seconds of it")],
)  # fmt: skip
def test_a_number_beside_a_date_that_can_be_two_times_is_asked_for(numbers, words):
    with pytest.raises(ProfileError, match=words) as asked:
        clock.of_day(pl.Series("t", numbers))
    assert 'format = "%H%M%S"' in str(asked.value)
    clock.of_day(pl.Series("t", numbers), unit="s")


@pytest.mark.parametrize(
    "times",
    [
        [datetime(2021, 4, 9, 12), datetime(9999, 12, 31)],
        ["2021-04-09 12:00:00", "9999-12-31 00:00:00"],
        ["2021-04-09T12:00:00Z", "0001-01-01T00:00:00Z"],
    ],
)
def test_a_date_that_stands_for_none_is_none(times):
    """Of databases: 64 bits of nanoseconds do not hold it, and polars made one of 1816."""
    assert clock.instants(pl.Series("t", times)).to_list() == [NOON, None]
    if isinstance(times[0], datetime):
        assert clock.dates(pl.Series("t", times)).null_count() == 1
    else:
        stamps = fields.stamps(pl.DataFrame({"stamp": times}), ("stamp",))
        assert stamps[1] is None


@pytest.mark.parametrize("between, end", [(" ", ""), ("T", ""), (" ", "Z"), (" ", " UTC")])
def test_either_form_that_is_proposed_reads_the_times(between, end):
    """3 April and 4 March 2024, 10:00 UTC: seconds of 1970 by a calendar."""
    times = pl.Series("t", [f"03/04/2024{between}10:00:00{end}"])
    with pytest.raises(ProfileError, match="day or with the month first") as asked:
        clock.instants(times)
    forms = asked.value.hint.split("format = ")[1].rstrip(".").split(" or ")
    read_so = {clock.instants(times, form=form.strip("'"))[0] for form in forms}
    assert read_so == {1_712_138_400 * 10**9, 1_709_546_400 * 10**9}


@pytest.mark.parametrize(
    "asks, numbers", [(clock.of_day, [83401, 83402]), (clock.instants, [1_000_000, 1_100_000])]
)
def test_the_line_that_is_proposed_for_a_column_is_toml(asks, numbers):
    with pytest.raises(ProfileError) as asked:
        asks(pl.Series("UTC time [s]", numbers))
    line = re.search(r"in \[table\]: (.*? \})", asked.value.hint)[1]
    assert tomllib.loads(line)["UTC time [s]"]["channel"] == "time"


def test_times_that_can_be_read_in_two_ways_are_asked_for():
    with pytest.raises(ProfileError, match="day or with the month first"):
        clock.instants(pl.Series("t", ["03/04/2024 10:00:00", "03/04/2024 10:00:01"]))
    (estimated,) = clock.instants(pl.Series("t", ["25/04/2024 10:00:00"]))
    assert datetime.fromtimestamp(estimated / 1e9).month == 4
    with pytest.raises(ProfileError, match="step by 100000"):
        clock.instants(pl.Series("timestamp", [1_000_000, 1_100_000, 1_200_000]))
    with pytest.raises(ProfileError, match="such as 20240323123451, step by 1") as asked:
        clock.instants(pl.Series("t", [20240323123450 + n for n in range(3)]))
    assert 'format = "%Y%m%d%H%M%S"' in str(asked.value)
    with pytest.raises(ProfileError, match="no known form"):
        clock.instants(pl.Series("t", ["yesterday", "today"]))
