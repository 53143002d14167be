"""The pictures of reports on these pages, from folders that `shiplog diagnose` wrote.

    python -m pipelines.experiments.site.pages season2=DIAGNOSIS [season3=DIAGNOSIS ...]

Each is drawn by a real Chromium without a window: wide, as on a phone, and the first printed page's
width. Chromium must be installed.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

from shiplog.report.page import html
from shiplog.report.page.diagnosis import page

PICTURES = Path(__file__).parents[3] / "docs" / "pictures"
VIEWS = {"": (1280, 1500), "-phone": (390, 1900)}  # end of the name → width and height, px
COLOURS = 224  # of a picture: letters stay sharp, and the file a tenth as large


def draw(name: str, diagnosis: Path, folder: Path) -> None:
    """report-NAME.png and report-NAME-phone.png of one verdict."""
    path = html.write(page.of_folder(diagnosis), folder / f"{name}.html")
    for end, (width, height) in VIEWS.items():
        made = folder / f"{name}{end}.png"
        subprocess.run(
            [
                shutil.which("chromium") or "chromium", "--headless", "--no-sandbox",
                "--disable-gpu", "--hide-scrollbars", f"--window-size={width},{height}",
                f"--screenshot={made}", path.as_uri(),
            ],
            check=True, capture_output=True,
        )  # fmt: skip
        small = Image.open(made).convert("RGB").quantize(COLOURS)
        small.save(PICTURES / f"report-{name}{end}.png", optimize=True)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as temporary:
        for given in sys.argv[1:]:
            called, _, where = given.partition("=")
            draw(called, Path(where), Path(temporary))
