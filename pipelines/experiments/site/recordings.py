"""The pictures of the viewer on these pages, from what `shiplog demo --out DEMO` recorded.

    python -m pipelines.experiments.site.recordings DEMO

It draws with Rerun's own viewer, without a window; a Vulkan driver is needed, such as Mesa's.
"""

from __future__ import annotations

import sys
from pathlib import Path

from shiplog.report.viewer.screenshot import screenshot

PICTURES = Path(__file__).parents[3] / "docs" / "pictures"
DRAWN = 8.0  # s: until the viewer's own messages have gone
RECORDINGS = {  # picture → recording in DEMO, second at which the ships are drawn
    "viewer": ("compare.rrd", 300.0),
    "season2": ("season2.rrd", 300.0),
    "diagnosis": ("diagnosis/diagnosis.rrd", 150.0),
}


def draw(demo: Path) -> None:
    """Each picture anew."""
    for name, (recording, second) in RECORDINGS.items():
        screenshot(demo / recording, PICTURES / f"{name}.png", second, drawn=DRAWN)


if __name__ == "__main__":
    draw(Path(sys.argv[1]))
