"""The wheel, installed next to what a data project calls its own folders."""

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
LOG = ROOT / "sample_logs" / "voyage_1.mcap"
BROKEN = "raise ImportError('this is the project of somebody else')\n"


@pytest.fixture(scope="module")
def environment(tmp_path_factory):
    """Python of an environment with the wheel, and with the packages of this one behind it.

    The wheel is made without a compiler: its kernel is optional, and takes most of the time.
    """
    folder = tmp_path_factory.mktemp("wheel")
    source = folder / "source"
    files = subprocess.run(
        ["git", "ls-files", "shiplog", "pyproject.toml", "README.md", "LICENSE"], cwd=ROOT,
        capture_output=True, text=True, check=False,
    ).stdout.split("\n")  # fmt: skip
    if not any(files):
        pytest.skip("this is no clone: what belongs to the wheel is not known")
    for name in filter(None, files):
        if (ROOT / name).exists():
            target = source / name
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes((ROOT / name).read_bytes())
    subprocess.run(
        [sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", "--no-build-isolation",
         "--wheel-dir", folder, source],
        env={**os.environ, "CC": "false", "CXX": "false"}, check=True,
    )  # fmt: skip
    (wheel,) = folder.glob("shiplog-*.whl")
    own = folder / "environment"
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", own], check=True)
    (packages,) = (own / "lib").glob("python*/site-packages")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(packages)
    behind = [path for path in sys.path if path.endswith("site-packages")]
    (packages / "behind.pth").write_text("\n".join(behind) + "\n")
    return own / "bin" / "python"


@pytest.fixture
def project(tmp_path):
    """A folder with packages of its own, called as data projects call theirs."""
    for name in ("pipelines", "tests", "experiments", "docs"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").write_text(BROKEN)
    return tmp_path


def test_one_name_is_installed(environment):
    (packages,) = (environment.parents[1] / "lib").glob("python*/site-packages")
    names = {path.name for path in packages.iterdir() if path.is_dir()}
    assert {name.split("-")[0] for name in names} == {"shiplog"}
    assert not list((packages / "shiplog").rglob("experiments"))
    assert (packages / "shiplog" / "profiles" / "esso-vectwin.toml").is_file()


def test_ingest_runs_beside_folders_called_pipelines_and_tests(environment, project):
    program = (
        "import sys, shiplog; assert 'environment' in shiplog.__file__, shiplog.__file__; "
        "print(shiplog.ingest(sys.argv[1], 'store'))"
    )
    done = subprocess.run(
        [environment, "-c", program, LOG], cwd=project, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("voyage_1: ")
    assert (project / "store" / "voyage=voyage_1" / "table.parquet").is_file()
