"""Times as people and programs write them: forms in strptime's letters, am and pm, day numbers."""

from datetime import UTC, datetime, timedelta

import numpy as np
import polars as pl
import pytest
from test_conversion import PROFILE

from shiplog.commands.convert import convert
from shiplog.drafting import draft_table
from shiplog.exceptions import ProfileError
from shiplog.logs.conversion import clock
from shiplog.logs.conversion.written_times import LETTERS
from shiplog.ship_profile import file as profiles

START = datetime(2024, 6, 1, 10, 0, 0, 0)
ROWS = [START + timedelta(seconds=0.1 * i) for i in range(50)]


def ns(when):
    since = when.replace(tzinfo=when.tzinfo or UTC) - datetime(1970, 1, 1, tzinfo=UTC)
    return ((since.days * 86_400 + since.seconds) * 1_000_000 + since.microseconds) * 1_000


FORMS = [
    "%d.%m.%Y %H:%M:%S.%f", "%Y-%m-%d %H:%M:%S,%f", "%Y%m%d%H%M%S%f", "%d/%m/%y %I:%M:%S.%f %p",
    "%b %d %Y %H:%M:%S.%f", "%d %B %Y, %H:%M:%S.%f", "%a %b %d %H:%M:%S.%f %Y",
    "%A %d.%m.%Y %H:%M:%S.%f", "%Y %j %H:%M:%S.%f", "%Y-%m-%dT%H:%M:%S.%f%z",
    "%Y-%m-%d %H:%M:%S.%f %Z", "%f s %S:%M:%H %d.%m.%Y", "at 100%% %Y-%m-%d %H.%M.%S.%f",
    "%Y-%m-%d (%H:%M:%S.%f) [UTC+0]", "%H:%M:%S.%f %d-%b-%Y", "%m/%d/%Y %I:%M:%S.%f%p",
]  # fmt: skip


@pytest.mark.parametrize("form", FORMS)
def test_a_form_reads_what_strptime_reads(form):
    zoned = [when.replace(tzinfo=UTC) if "%z" in form or "%Z" in form else when for when in ROWS]
    texts = [when.strftime(form) for when in zoned]
    wanted = [ns(datetime.strptime(text, form)) for text in texts]
    assert wanted == [ns(when) for when in ROWS]
    assert clock.instants(pl.Series("t", texts), form=form).to_list() == wanted


CASES = [  # a text, its form
    ("1.6.2024 9:05:07", "%d.%m.%Y %H:%M:%S"), ("01.06.24 09:05:07", "%d.%m.%y %H:%M:%S"),
    ("01.06.68 09:05:07", "%d.%m.%y %H:%M:%S"), ("01.06.70 09:05:07", "%d.%m.%y %H:%M:%S"),
    ("2024-06-01 12:00:00 am", "%Y-%m-%d %I:%M:%S %p"),
    ("2024-06-01 12:00:00 PM", "%Y-%m-%d %I:%M:%S %p"),
    ("2024-06-01 01:13:21 pm", "%Y-%m-%d %I:%M:%S %p"),
    ("2024-06-01 10:00:00.1", "%Y-%m-%d %H:%M:%S.%f"),
    ("2024-06-01 10:00:00.12", "%Y-%m-%d %H:%M:%S.%f"),
    ("2024-06-01 10:00:00.000001", "%Y-%m-%d %H:%M:%S.%f"),
    ("2024-06-01 10:00:00+0230", "%Y-%m-%d %H:%M:%S%z"),
    ("2024-06-01 10:00:00 -05:00", "%Y-%m-%d %H:%M:%S %z"),
    ("2024-06-01 10:00:00Z", "%Y-%m-%d %H:%M:%S%z"), ("29 feb 2024", "%d %b %Y"),
    ("2024-06-01  10:00", "%Y-%m-%d %H:%M"), ("JUNE 1 2024 10h", "%B %d %Y %Hh"),
    ("Mon 01.06.2024 10:00:00", "%a %d.%m.%Y %H:%M:%S"),  # it was a Saturday; nobody asks
    ("2024 366", "%Y %j"), ("2024 060", "%Y %j"), ("20240601 100000", "%Y%m%d %H%M%S"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "form"), CASES)
def test_a_text_is_what_strptime_makes_of_it(text, form):
    (found,) = clock.instants(pl.Series("t", [text]), form=form)
    assert found == ns(datetime.strptime(text, form))


NONE = [
    ("31.06.2024 10:00:00", "%d.%m.%Y %H:%M:%S"), ("29.02.2023 10:00:00", "%d.%m.%Y %H:%M:%S"),
    ("01.13.2024 10:00:00", "%d.%m.%Y %H:%M:%S"), ("01.06.2024 24:00:00", "%d.%m.%Y %H:%M:%S"),
    ("01.06.2024 10:60:00", "%d.%m.%Y %H:%M:%S"), ("01.06.2024 10:00:00 x", "%d.%m.%Y %H:%M:%S"),
    ("01.06.2024 13:00:00 pm", "%d.%m.%Y %I:%M:%S %p"), ("01.06.2024", "%d.%m.%Y %H:%M:%S"),
    ("01-06-2024 10:00:00", "%d.%m.%Y %H:%M:%S"), ("1 juin 2024", "%d %b %Y"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "form"), NONE)
def test_what_strptime_refuses_is_no_time(text, form):
    with pytest.raises(ValueError, match=r"."):
        datetime.strptime(text, form)
    sound = "01.06.2024 10:00:00" if "%H" in form else "01.06.2024 10:00:00 am"
    sound = "1 Jun 2024" if "%b" in form else sound
    found = clock.instants(pl.Series("t", [sound, text]), form=form)
    assert found[0] is not None and found[1] is None


@pytest.mark.parametrize("digits", [1, 2, 3, 6, 7, 9])
def test_microseconds_of_any_number_of_digits(digits):
    """Of a form that strptime has for 1 to 6: 0.1 s is 0.100 000 s, and not 100 ns."""
    text = f"01.06.2024 10:00:00.{'123456789'[:digits]}"
    (found,) = clock.instants(pl.Series("t", [text]), form="%d.%m.%Y %H:%M:%S.%f")
    assert found - ns(START) == int("123456789"[:digits].ljust(9, "0"))


def test_a_leap_second_is_the_next_minute():
    (found,) = clock.instants(pl.Series("t", ["2016-12-31 23:59:60"]), form="%Y-%m-%d %H:%M:%S")
    assert found == ns(datetime(2017, 1, 1))


@pytest.mark.parametrize(
    ("form", "said"),
    [("%c", "%c"), ("%x %X", "%x"), ("%Y-%W-%w %H:%M", "%W"), ("%G-%V-%u %H:%M", "%G"),
     ("%Y-%m-%d %Q", "%Q"), ("%d.%m. %H:%M:%S", "year"), ("%Y-%m-%d %I:%M:%S", "%p"),
     ("%Y-%m-%d %H:%M:%S %p", "%I"), ("%Y-%m-%d %H:%M:%S %", "%")],
)  # fmt: skip
def test_a_form_that_is_not_read_is_refused_with_what_to_write(form, said):
    with pytest.raises(ProfileError) as refused:
        clock.instants(pl.Series("t", ["2024-06-01 10:00:00 am"]), form=form)
    assert said in refused.value.message and "%Y" in refused.value.hint


def test_every_letter_that_is_documented_is_tried():
    used = {form[i + 1] for form in FORMS for i in range(len(form) - 1) if form[i] == "%"}
    assert used >= set(LETTERS)
    page = profiles.Column.model_fields["format"].description
    assert all(f"%{letter}" in page for letter in LETTERS)


def test_the_case_of_a_form_in_a_profile(tmp_path):
    lines = [f"{when:%d.%m.%Y %H:%M:%S.%f},0,0,1,0,5"[: -0 or None] for when in ROWS]
    (tmp_path / "t.csv").write_text("\n".join(["t,x,y,u,v,psi", *lines]))
    form = '{ channel = "time", format = "%d.%m.%Y %H:%M:%S.%f" }'
    profile = profiles.parse(PROFILE.replace('t = "time"', f"t = {form}"), "mine")
    done = convert([tmp_path / "t.csv"], profile, tmp_path / "out")
    assert done.logs and not done.lost


# am and pm, without a form

HOURS = [datetime(2024, 6, 25, 11, 59, 58) + timedelta(seconds=i) for i in range(6)]


@pytest.mark.parametrize(
    ("form", "change"),
    [
        ("%m/%d/%Y %I:%M:%S %p", str), ("%m/%d/%Y %I:%M:%S.00 %p", str.lower),
        ("%d.%m.%Y %I:%M:%S%p", str.lower), ("%Y-%m-%dT%I:%M:%S %p", str),
        ("%Y-%m-%d %I:%M:%S %p", lambda t: t.replace("AM", "a.m.").replace("PM", "p.m.")),
    ],
)  # fmt: skip
def test_am_and_pm_are_read(form, change):
    texts = pl.Series("t", [change(when.strftime(form)) for when in HOURS])
    assert clock.instants(texts).to_list() == [ns(when) for when in HOURS]


@pytest.mark.parametrize("form", ["%I:%M:%S %p", "%I:%M:%S.000 %p", "%I:%M:%S%p"])
def test_a_time_of_day_in_am_and_pm(form):
    texts = pl.Series("t", [when.strftime(form) for when in HOURS])
    found = clock.instants(texts).to_numpy() * 1e-9
    assert found == pytest.approx(11 * 3600 + 59 * 60 + 58 + np.arange(6))
    night = [datetime(2024, 6, 25, 23, 59, 58) + timedelta(seconds=i) for i in range(6)]
    found = clock.instants(pl.Series("t", [when.strftime(form) for when in night]))
    assert found.diff().drop_nulls().to_list() == [10**9] * 5


def test_what_is_quoted_of_a_time_stands_in_the_table():
    with pytest.raises(ProfileError) as refused:
        clock.instants(pl.Series("t", ["10:00:00 Uhr", "10:00:01 Uhr"]))
    assert "10:00:00 Uhr" in refused.value.message and "1970" not in refused.value.message


@pytest.mark.parametrize(
    ("texts", "when"),
    [(["05-Jun-2021 10:00:00.5"], datetime(2021, 6, 5, 10, 0, 0, 500_000)),
     (["5 Jun 2021 10:00:00"], datetime(2021, 6, 5, 10)),
     (["25/06/45 10:00:00"], datetime(2045, 6, 25, 10)),
     (["25.06.21 10:00:00"], datetime(2021, 6, 25, 10)),
     (["2021-06-05 10:00:00,500"], datetime(2021, 6, 5, 10, 0, 0, 500_000)),
     (["25-06-2021 10:00:00"], datetime(2021, 6, 25, 10))],
)  # fmt: skip
def test_more_dates_that_can_be_only_one(texts, when):
    assert clock.instants(pl.Series("t", texts)).to_list() == [ns(when)]


def test_a_date_of_two_digits_that_can_be_two_is_asked_for():
    with pytest.raises(ProfileError, match="day or with the month first") as asked:
        clock.instants(pl.Series("t", ["05/06/21 10:00:00", "05/06/21 10:00:01"]))
    assert "%d/%m/%y" in asked.value.hint and "%m/%d/%y" in asked.value.hint
    with pytest.raises(ProfileError, match="month first"):
        clock.dates(pl.Series("t", ["05/06/21", "05/06/21"]))
    with pytest.raises(ProfileError, match="day or with the year first"):
        clock.dates(pl.Series("t", ["25/06/21"]))
    assert clock.dates(pl.Series("t", ["25.06.21"])).to_list() == [ns(datetime(2021, 6, 25))]


# numbers of days

SPREADSHEET = datetime(1899, 12, 30)  # its day 0


def days(since, rows, digits):
    return [round((when - since) / timedelta(days=1), digits) for when in rows]


SECONDS = [datetime(2021, 6, 5, 10) + timedelta(seconds=i) for i in range(600)]


@pytest.mark.parametrize("unit", [None, "d"])
@pytest.mark.parametrize(
    ("since", "digits", "within"),
    [(SPREADSHEET, 9, 1e-4), (SPREADSHEET, 5, 0.44), (None, 9, 1e-4),
     (datetime(1858, 11, 17), 9, 1e-4)],
    ids=["spreadsheet", "spreadsheet of five decimals", "MATLAB", "modified Julian"],
)  # fmt: skip
def test_days_are_days(since, digits, within, unit):
    numbers = days(since, SECONDS, digits) if since else [
        when.toordinal() + 366 + (when.hour * 3600 + when.minute * 60 + when.second) / 86_400
        for when in SECONDS]  # fmt: skip
    found = clock.instants(pl.Series("t", numbers), unit)
    wanted = np.array([ns(when) for when in SECONDS])
    assert np.abs(found.to_numpy() - wanted).max() * 1e-9 <= within


def test_days_since_a_year_s_start_are_asked_for_and_count_from_any_start():
    numbers = pl.Series("t", [156.0 + 10 / 24 + i / 86_400 for i in range(600)])
    with pytest.raises(ProfileError) as asked:
        clock.instants(numbers)
    assert 'unit = "d"' in asked.value.hint and "1.16e-05" in asked.value.message
    found = clock.instants(numbers, "d").to_numpy() * 1e-9
    assert found - found[0] == pytest.approx(np.arange(600), abs=1e-3)


def test_hours_with_decimals_are_asked_for():
    with pytest.raises(ProfileError, match=r"0\.000278"):
        clock.instants(pl.Series("t", [10.0 + i / 3600 for i in range(600)]))


@pytest.mark.parametrize("step", [0.001, 0.01, 0.1, 1.0, 60.0])
def test_seconds_near_40000_stay_seconds(step):
    seconds = 44_000.0 + step * np.arange(100)
    found = clock.instants(pl.Series("t", seconds)).to_numpy() * 1e-9
    assert found == pytest.approx(seconds)


@pytest.mark.parametrize(
    "cut",
    [
        [f"{1717236000000 + 100 * i:.5E}" for i in range(100)],
        [f"{1717236000 + i:.5E}" for i in range(20_000)],
        [f"{1717236000000000 + 100_000 * i:.5e}" for i in range(100)],
        [f"{20240601100000 + i:.5E}" for i in range(50)],
        [f"{1717236000000 + 100 * i:.5E}".replace(".", ",") for i in range(100)],
    ],
    ids=["ms", "s", "us", "digits of a date", "decimal comma"],
)
def test_times_that_a_spreadsheet_cut_are_refused_as_such(cut):
    with pytest.raises(ProfileError) as refused:
        clock.instants(pl.Series("t", cut))
    assert "cut" in refused.value.message and "all its digits" in refused.value.hint
    numbers = pl.Series("t", [float(text.replace(",", ".")) for text in cut])
    with pytest.raises(ProfileError, match="cut"):
        clock.instants(numbers)


def test_one_row_every_hour_is_not_cut():
    hours = pl.Series("t", [1_717_236_000 + 3600 * i for i in range(100)])
    assert clock.instants(hours, "s").diff().drop_nulls().to_list() == [3600 * 10**9] * 99


def test_a_draft_of_day_numbers_says_days(tmp_path):
    numbers = days(SPREADSHEET, SECONDS, 5)
    rows = "".join(f"{day:.5f},5\n" for day in numbers)
    (tmp_path / "t.csv").write_text("Utc,Heading\n" + rows)
    line = next(x for x in draft_table(tmp_path / "t.csv").splitlines() if x.startswith('"Utc"'))
    assert 'unit = "d"' in line and "CHECK" in line and "600 rows" in line
