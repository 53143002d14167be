"""Lists of ships: what a line says, and what is refused of a list before any work."""

import pytest

from shiplog.exceptions import FleetError
from shiplog.report.fleet import ship_list

HEAD = "run,store,voyages\n"


@pytest.fixture
def written(tmp_path):
    def write(content, name="ships.csv"):
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return write


def test_a_line_names_run_store_and_voyages(written, tmp_path):
    """Relative paths are the list's folder's; blank lines and other columns are left alone."""
    text = (
        "Note,Voyages,run,store\n,june_*; trip[0:600] ,atlas/mmg,atlas/store\n\n"
        '"new, from June",,/b/mmg,/b/store\n'
    )
    one, two = ship_list.read(written(text))
    assert (one.line, two.line) == (2, 4)
    assert one.run_path == tmp_path / "atlas" / "mmg"
    assert one.store_path == tmp_path / "atlas" / "store"
    assert one.patterns == ("june_*", "trip[0:600]")
    assert (str(two.run_path), two.patterns) == ("/b/mmg", ())


def test_a_list_of_a_spreadsheet(written):
    """A byte order mark, carriage returns, and cells that are left out at the end of a line."""
    text = "run,store,voyages\r\na,b\r\n".encode("utf-8-sig")
    (ship,) = ship_list.read(written(text))
    assert (ship.run, ship.store, ship.voyages) == ("a", "b", "")


def test_folders_stay_when_lines_move_and_differ_for_runs_of_one_name(written):
    text = HEAD + "a/mmg,a/store,x\nb/mmg,b/store,x\nb/mmg,b/store,y\n"
    ships = ship_list.read(written(text))
    moved = ship_list.read(written(HEAD + "c/mmg,c/store,\n" + text.split("\n", 1)[1], "moved.csv"))
    assert [ship.folder for ship in moved[1:]] == [ship.folder for ship in ships]
    assert len({ship.folder for ship in moved}) == 4
    assert all(ship.folder.startswith("mmg-") for ship in ships)


@pytest.mark.parametrize("name", ["../../etc", "..", "a\nb", "=cmd|x", "/", "-" * 300, "\u202egpj"])
def test_a_folder_has_a_plain_name_whatever_the_run_is_called(written, name):
    (ship,) = ship_list.read(written(f'{HEAD}"{name}",store,\n'))
    assert len(ship.folder) <= 49
    assert set(ship.folder) <= set(
        "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-"
    )


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "is empty"),
        (b" \n\n", "is empty"),
        (HEAD.encode(), "no line below its head"),
        (b"run,store\na,b\n", "column voyages is not there"),
        (b"run,stores,voyages\na,b,c\n", "did you mean 'stores'?"),
        (b"run;store;voyages\na;b;c\n", "Its head has run;store;voyages"),
        (b"run,run,store,voyages\na,b,c,d\n", "column run is twice"),
        (HEAD.encode() + b",store,\n", "line 2: the column run is empty"),
        (HEAD.encode() + b"mmg, ,\n", "line 2: the column store is empty"),
        (HEAD.encode() + b"a,b,x,y\n", "4 cells stand under 3 columns"),
        (HEAD.encode() + b"a,b,x\nc,d,x\na,b, x ;\n", "line 4 says the same as line 2"),
        (HEAD.encode() + b'a,b,"x\n', "line 2"),
        (HEAD.encode() + b"a,b," + b"x" * 200_000 + b"\n", "field limit"),
        (b"run,store,voyages\n\xff\xfe,b,c\n", "no text in UTF-8"),
        (HEAD.encode() + b"a\0,b,\n", "zero byte"),
    ],
)  # fmt: skip
def test_what_is_no_list_is_refused(written, content, words):
    path = written(content)
    with pytest.raises(FleetError) as told:
        ship_list.read(path)
    assert words in str(told.value) and str(path) in str(told.value) and told.value.hint


def test_a_list_that_is_not_there_or_no_file(tmp_path, monkeypatch):
    with pytest.raises(FleetError, match="does not exist"):
        ship_list.read(tmp_path / "none.csv")
    with pytest.raises(FleetError, match="is a folder"):
        ship_list.read(tmp_path)
    monkeypatch.setattr(ship_list, "MOST_BYTES", 10)
    (tmp_path / "long.csv").write_text(HEAD)
    with pytest.raises(FleetError, match="no list of ships"):
        ship_list.read(tmp_path / "long.csv")
