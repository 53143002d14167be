"""What tests share: the folder of real logs, where there is one."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

# Many small matrices: BLAS's threads would wait for each other. Set before numpy is loaded.
for _threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(_threads, "1")


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """`../shared/data` next to the repository; it is not shipped."""
    folder = Path(__file__).parents[2] / "shared" / "data"
    if not folder.is_dir():
        if os.environ.get("SHIPLOG_REQUIRE_SHARED"):
            pytest.fail("../shared/data was there when CI began and is not found")
        pytest.skip("../shared/data is not here")
    return folder


@pytest.fixture(scope="session")
def no_viewer():
    """Skip, or fail where CI has installed what the headless viewer needs."""

    def stop(reason: str):
        if os.environ.get("SHIPLOG_REQUIRE_VIEWER"):
            pytest.fail(reason)
        pytest.skip(reason)

    return stop
