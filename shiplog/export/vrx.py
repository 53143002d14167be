"""`--to vrx`: the plugin SimpleHydrodynamics of VRX (for Gazebo), as XML of a model.

Force = -(c + c' |w|) w of surge, sway and yaw, each by itself, and -M w': its drag is positive, and
nothing couples sway and yaw.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from xml.etree import ElementTree as xml

from shiplog.export import gazebo, hull_terms
from shiplog.export.hull_terms import Fitted
from shiplog.export.job import Job
from shiplog.export.not_loaded import NotLoaded
from shiplog.export.trial import Difference
from shiplog.machine import files

CONSUMER = "VRX"
# Of the plugin's names, the terms; VRX calls u |u| uu.
TERMS = {"xU": "xU", "xUU": "xUabsU", "yV": "yV", "yVV": "yVabsV", "nR": "nR", "nRR": "nRabsR"}
ROOM = 10.0  # times the hull's largest force in the training data, which the plugin crops


def fitted(job: Job) -> Fitted:
    return hull_terms.fit(job, tuple(TERMS.values()))


def write(job: Job, path: Path, record: Sequence[str]) -> None:
    """Raises ModelError for a run without the hull of an MMG."""
    of = fitted(job)
    plugin = xml.Element("plugin", {
        "filename": "libSimpleHydrodynamics.so", "name": "vrx::SimpleHydrodynamics",
    })  # fmt: skip
    gazebo.put(plugin, "link_name", "base_link")
    for name, value in zip(("xDotU", "yDotV", "nDotR"), of.added, strict=True):
        gazebo.put(plugin, name, repr(value))
    for name, one in TERMS.items():
        gazebo.put(plugin, name, repr(-of.values[one]))
    w = job.sailor.training.select("surge", "sway", "yaw_rate").to_numpy()
    most = max(float(abs(of.values[one] * hull_terms.term(one, w)).max()) for one in TERMS.values())
    gazebo.put(plugin, "max_effort", repr(ROOM * most))
    files.write_text(path, gazebo.text(job, of, plugin, record))


def losses(job: Job) -> tuple[str, ...]:
    of = fitted(job)
    return hull_terms.losses(job, (
        f"What drag by itself leaves of the hull: it explains {hull_terms.percent(of)} over the "
        "training data. The plugin has no force of drifting in yaw and none of turning in sway: "
        "course stability and drift angle are not those of the ship.",
        "Coriolis forces of added mass: the plugin works them out and does not apply them.",
        "How inertia in yaw and added inertia share their sum: a radius of gyration of L/4 is "
        "taken.",
    ))  # fmt: skip


def compare(job: Job, path: Path) -> Difference:
    """Raises NotLoaded."""
    raise NotLoaded(
        "it is not installed here; the names and signs are those of vrx_gz's SimpleHydrodynamics.cc"
    )


def version() -> str:
    return ""
