"""The table of the tutorial is installed with shiplog, and its five trips are those of the page."""

import gzip
import subprocess
import sys
from pathlib import Path

import shiplog

TABLE = Path(*shiplog.__path__) / "examples" / "trips.csv.gz"
TUTORIAL = Path(__file__).parents[2] / "docs" / "start" / "tutorial.md"


def test_the_tutorials_commands_copy_its_table(tmp_path):
    block = TUTORIAL.read_text(encoding="utf-8").split("```bash\n")[1].split("```")[0]
    env = {"PATH": f"{Path(sys.executable).parent}:/usr/bin:/bin", "HOME": str(tmp_path)}
    subprocess.run(["bash", "-euc", block], cwd=tmp_path, env=env, check=True)
    assert (tmp_path / "trips.csv").read_bytes() == gzip.decompress(TABLE.read_bytes())


def test_it_holds_five_trips_of_the_seconds_that_the_page_has():
    head, *rows = gzip.decompress(TABLE.read_bytes()).decode().splitlines()
    page = TUTORIAL.read_text(encoding="utf-8")
    assert head.startswith("Time;Trip;Lat;Lon;SOG (kn)") and head[:90] in page
    assert rows[0][:90] in page
    trips = [row.split(";")[1] for row in rows]
    assert {name: trips.count(name) // 5 for name in dict.fromkeys(trips)} == {
        "june_1": 1198, "june_2": 1198, "june_3": 1198, "september_1": 898, "september_2": 898,
    }  # fmt: skip
