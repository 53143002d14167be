"""Digits, signs and groups of digits of a text table, as its whole file decides them."""

import pytest
from test_conversion import PROFILE

from shiplog.commands.convert import convert
from shiplog.drafting import draft_table
from shiplog.logs.conversion.delimited import read_table
from shiplog.ship_profile import file as profiles


def table(tmp_path, text):
    (tmp_path / "t.csv").write_text(text, encoding="utf-8")
    return read_table(tmp_path / "t.csv")


def column(tmp_path, text, name="b"):
    return table(tmp_path, text).frame[name].to_list()


@pytest.mark.parametrize(
    ("text", "values"),
    [
        # three digits after a comma, quoted between commas: the other column has decimal commas
        ('a,b\n"0,512","40,000"\n"1,25","41,125"\n', [40.0, 41.125]),
        ('a,b\n"-0,041","2,000"\n"-0,1","1,500"\n', [2.0, 1.5]),
        ('a;b\n0,5;12,000\n0,25;900,125\n', [12.0, 900.125]),
        ('a\tb\n1234,5\t1,199\n1240,5\t900\n', [1.199, 900.0]),
        ('a;b\n1.234,5;1,199\n2.240,5;900\n', [1.199, 900.0]),
        # and here decimal dots, so that commas group
        ('a,b\n0.512,"40,000"\n1.25,"41,125"\n', [40000, 41125]),
        ('a;b\n54.00001;1,199\n54.00002;900\n', [1199, 900]),
        ('a,b\n0.5,"1,234.5"\n0.6,"1,2"\n', ["1234.5", "1,2"]),  # the last is no number at all
        # dots that group, in a table of decimal commas
        ('a;b\n0,5;1.199\n0,6;899\n', [1199, 899]),
        ('a;b\n0,5;1.234.567\n0,6;12.001\n', [1234567, 12001]),
        ('a;b\n0,5;-1.199,25\n0,6;2,5\n', [-1199.25, 2.5]),
        ('a,b\n"0,5","12.001"\n"0,6","11.999"\n', [12001, 11999]),
        # dots that are decimal, as everywhere
        ('a;b\n1;1.199\n2;2.001\n', [1.199, 2.001]),
        ('a,b\n0.5,1.199\n0.6,899\n', [1.199, 899.0]),
        ('a,b\n1,10.125\n2,9\n3,0.5\n', [10.125, 9.0, 0.5]),
        # one column decides for itself, whatever the other has
        ('a,b\n0.5,"2,25"\n0.6,"40,000"\n', [2.25, 40.0]),
        ('a;b\n0,5;2.25\n0,6;40.000\n', [2.25, 40.0]),
        # comma and ungrouped thousands in one column: it groups nothing
        ("a;b\n1;1500\n2;1,199\n", [1500.0, 1.199]),
        ("a;b\n1;1,5e3\n2;1,199\n", [1500.0, 1.199]),
    ],
)  # fmt: skip
def test_the_whole_file_says_what_a_comma_or_a_dot_is(tmp_path, text, values):
    assert column(tmp_path, text) == values


@pytest.mark.parametrize("sign", ["\u202f", "\u00a0", "\u2009", "'", "\u2019", " "])
def test_spaces_and_apostrophes_group_thousands(tmp_path, sign):
    assert column(tmp_path, f"a;b\n1;1{sign}199,25\n2;899,5\n") == [1199.25, 899.5]
    assert column(tmp_path, f"a;b\n1;12{sign}345{sign}678\n2;899\n") == [12345678, 899]
    assert column(tmp_path, f"a,b\n1,1{sign}199.25\n2,-2{sign}000\n") == [1199.25, -2000.0]
    # no group of three digits: two words, and no number
    assert column(tmp_path, f"a;b\n1;54{sign}12\n2;x\n") == [f"54{sign}12", "x"]


@pytest.mark.parametrize("minus", ["\u2010", "\u2011", "\u2012", "\u2013", "\u2212", "-"])
def test_a_dash_before_a_digit_is_a_minus(tmp_path, minus):
    assert column(tmp_path, f"a;b\n1;{minus}0,5\n2;3,25\n3;{minus},5\n") == [-0.5, 3.25, -0.5]
    assert column(tmp_path, f"a,b\n1,{minus}12\n2,7\n") == [-12, 7]
    assert column(tmp_path, f'a,b\n1,"{minus}1,234.5"\n2,0.25\n') == [-1234.5, 0.25]


@pytest.mark.parametrize("dash", ["\u2010", "\u2013", "\u2014", "\u2212", "-"])
def test_a_lone_dash_is_blank_and_a_date_keeps_its_dashes(tmp_path, dash, caplog):
    read = table(tmp_path, f"day,b\n2024{dash}06{dash}01,{dash}\n2024{dash}06{dash}02,1.5\n").frame
    assert read["b"].to_list() == [None, 1.5]
    assert read["day"][0] == f"2024{dash}06{dash}01"
    assert not caplog.text


NAMES = "t;x;y;u;v;psi"
OPEN = [f"{i};0;0;1;0;{i},000" for i in range(10, 40)]  # 10,000 deg, or 10 000?


def test_a_comma_that_no_column_decides_is_asked_for(tmp_path):
    (tmp_path / "t.csv").write_text("\n".join([NAMES, *OPEN]))
    done = convert([tmp_path / "t.csv"], profiles.parse(PROFILE, "mine"), tmp_path / "out")
    (why,) = done.refused.values()
    assert "'psi'" in why and "'10,000'" in why and 'decimal = ","' in why
    assert not list(tmp_path.glob("out/*"))


@pytest.mark.parametrize(("sign", "first"), [(",", 10.0), (".", 10000.0)])
def test_a_profile_says_which_comma_is_meant(tmp_path, sign, first):
    (tmp_path / "t.csv").write_text("\n".join([NAMES, *OPEN]))
    stated = PROFILE.replace(
        'psi = { channel = "heading"', f'psi = {{ channel = "heading", decimal = "{sign}"'
    )
    assert stated != PROFILE
    table = profiles.parse(stated, "mine").table
    assert read_table(tmp_path / "t.csv", table).frame["psi"][0] == first


def test_a_column_that_no_profile_uses_is_not_asked_for(tmp_path):
    rows = [f"{i};0;0;1;0;{i};{i},000" for i in range(10, 40)]
    (tmp_path / "t.csv").write_text("\n".join([NAMES + ";depth", *rows]))
    done = convert([tmp_path / "t.csv"], profiles.parse(PROFILE, "mine"), tmp_path / "out")
    assert done.logs and not done.refused and not done.lost


def test_dots_that_stand_at_a_thousand_alone_are_asked_for(tmp_path):
    """899, 900, 1.001: of three values no one is a decimal one for sure, and the step says 1001."""
    rows = [f"{i};0;0;1;0;{f'{899 + i:,}'.replace(',', '.')}" for i in range(200)]
    (tmp_path / "t.csv").write_text("\n".join([NAMES, *rows]))
    (why,) = convert(
        [tmp_path / "t.csv"], profiles.parse(PROFILE, "mine"), tmp_path / "out"
    ).refused.values()
    assert "'1.000'" in why and "decimal" in why


def test_a_draft_says_what_it_cannot_tell(tmp_path):
    rows = [f"2024-06-01 10:00:{i};{i},000" for i in range(10, 40)]
    (tmp_path / "t.csv").write_text("\n".join(["time;heading", *rows]))
    line = next(x for x in draft_table(tmp_path / "t.csv").splitlines() if 'heading" =' in x)
    assert "CHECK" in line and "10,000" in line and "decimal" in line


def test_half_of_a_column_lost_is_a_loss(tmp_path):
    rows = [f"{i};{i};0;1;0;{'5 deg' if i % 3 else 5}" for i in range(30)]
    (tmp_path / "t.csv").write_text("\n".join([NAMES, *rows]))
    done = convert([tmp_path / "t.csv"], profiles.parse(PROFILE, "mine"), tmp_path / "out")
    (lost,) = done.lost.values()
    assert "20 of 30 values of 'psi' are no numbers, such as '5 deg'" in lost


@pytest.mark.parametrize("first", ["1 000;\u20130.5", "1'000;-0.5", "1\u202f000;0.25"])
def test_a_first_row_of_grouped_numbers_is_no_row_of_units(tmp_path, first):
    read = table(tmp_path, f"a;b\n{first}\n999;0.5\n998;0.75\n")
    assert read.frame["a"].to_list() == [1000, 999, 998] and not read.units


def test_dots_next_to_commas_that_are_asked_for_are_asked_for_too(tmp_path):
    found = table(tmp_path, 'a,b\n"1.000","2,742"\n"1.001","3,008"\n')
    assert found.undecided == {"a": "1.000", "b": "2,742"}
