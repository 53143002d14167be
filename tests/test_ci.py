"""What CI says of tests that were skipped, and which of them must not be."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PRINTED = (
    """........ss..
=========================== short test summary info ============================
SKIPPED [2] tests/training/test_seeds.py:114: no GPU that torch can use
SKIPPED [1] tests/training/test_cluster.py:18: needs Ray: pip install '.[ray]'
""",
    "SKIPPED [3] tests/models/test_gpu.py:9: no GPU that torch can use\n",
)
MODULE = """
import pytest

def test_first(no_viewer):
    no_viewer("no headless viewer here: no driver")

def test_second():
    pytest.skip("no chromium and chromedriver here")

def test_third(shared_data):
    pass
"""


@pytest.mark.parametrize(
    ("printed", "counted"),
    [
        (PRINTED, ["6 tests were skipped", "5 no GPU that torch can use",
                   "1 needs Ray: pip install '.[ray]'"]),
        (("12 passed in 3 s\n",), ["0 tests were skipped"]),
    ],
)  # fmt: skip
def test_skips_are_counted_by_reason(tmp_path, printed, counted):
    paths = [tmp_path / f"{number}.txt" for number in range(len(printed))]
    for path, text in zip(paths, printed, strict=True):
        path.write_text(text, encoding="utf-8")
    command = [sys.executable, ROOT / ".ci" / "skips", *paths]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert [" ".join(line.split()) for line in done.stdout.splitlines()] == counted


@pytest.mark.parametrize(
    ("required", "ended"),
    [
        ((), "3 skipped"),
        (("VIEWER",), "1 failed, 2 skipped"),
        (("BROWSER", "SHARED"), "1 failed, 1 skipped, 1 error"),  # of a fixture
    ],
)
def test_where_ci_has_installed_what_a_test_needs_it_does_not_skip(tmp_path, required, ended):
    conftest = (ROOT / "tests" / "conftest.py").read_text(encoding="utf-8")
    (tmp_path / "tests").mkdir()
    (tmp_path / "tests" / "conftest.py").write_text(conftest, encoding="utf-8")
    (tmp_path / "tests" / "test_needy.py").write_text(MODULE, encoding="utf-8")
    variables = {f"SHIPLOG_REQUIRE_{name}": "1" for name in required}
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-rs", "-p", "no:cacheprovider", "tests"],
        cwd=tmp_path,
        env={"PATH": "/usr/bin:/bin", "HOME": str(tmp_path), **variables},
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended in done.stdout, done.stdout
    for name in variables:
        assert f"{name} is set. " in done.stdout
