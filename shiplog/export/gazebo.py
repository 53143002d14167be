"""`--to gazebo`: the hydrodynamics plugin of Gazebo (gz-sim 8), as XML of a model.

Force = (c_j + Σ_k c_jk |w_k| + Σ_k c'_jk w_k) w_j + M w': the plugin's own Coriolis terms of added
mass are switched off, and are among these terms, with the signs of a ship (Fossen 2011, Sec. 6.3).
Gazebo's body axes are ahead, to port, up: of a ship that is the same on both sides, coefficients
are the same in them.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from xml.etree import ElementTree as xml

from shiplog.export import hull_terms
from shiplog.export.filled import inert
from shiplog.export.hull_terms import Fitted
from shiplog.export.job import Job
from shiplog.export.not_loaded import NotLoaded
from shiplog.export.trial import Difference
from shiplog.machine import files

CONSUMER = "Gazebo"
TERMS = (
    "xU", "xUabsU", "xVR", "yV", "yVabsV", "yVabsU", "yVabsR", "yR", "yRU", "yRabsR", "yRabsV",
    "nV", "nVU", "nVabsV", "nVabsR", "nR", "nRabsU", "nRabsR", "nRabsV",
)  # fmt: skip


def fitted(job: Job) -> Fitted:
    return hull_terms.fit(job, TERMS, coriolis=True)


def write(job: Job, path: Path, record: Sequence[str]) -> None:
    """Raises ModelError for a run without the hull of an MMG."""
    of = fitted(job)
    plugin = xml.Element("plugin", {
        "filename": "gz-sim-hydrodynamics-system", "name": "gz::sim::systems::Hydrodynamics",
    })  # fmt: skip
    put(plugin, "link_name", "base_link")
    put(plugin, "disable_coriolis", "true")
    for name, value in zip(("xDotU", "yDotV", "nDotR"), of.added, strict=True):
        put(plugin, name, repr(-value))
    for name, value in of.values.items():
        put(plugin, name, repr(value))
    files.write_text(path, text(job, of, plugin, record))


def text(job: Job, of: Fitted, plugin: xml.Element, record: Sequence[str]) -> str:
    """A fragment of a model: its inertia, and the plugin."""
    inertial = xml.Element("inertial")
    put(inertial, "pose", f"{of.x_g!r} 0 0 0 0 0")
    put(inertial, "mass", repr(of.mass))
    put(xml.SubElement(inertial, "inertia"), "izz", repr(of.inertia))
    ship = job.run.profile.ship.name
    head = [
        f"{ship}: the hull of the run {job.run.name}, {job.run.label}, written by "
        f"{job.ship.author}.",
        "Into the model's SDF: inertial into its base_link (ixx and iyy are yours), plugin next to"
        " the link, whose origin is midship at the waterline. SI.",
        f"Fitted over the training data: {hull_terms.percent(of)}.",
        *record, *(f"Not in it: {one}" for one in losses(job)),
    ]  # fmt: skip
    parts = []
    for one in (inertial, plugin):
        xml.indent(one)
        parts.append(xml.tostring(one, "unicode"))
    # a comment of XML holds no two hyphens
    said = "\n".join(f"  {inert(line).replace('--', '- -')}" for line in head)
    return f"<!--\n{said}\n-->\n" + "\n".join(parts) + "\n"


def put(parent: xml.Element, name: str, value: str) -> None:
    xml.SubElement(parent, name).text = value


def losses(job: Job) -> tuple[str, ...]:
    of = fitted(job)
    return hull_terms.losses(job, (
        f"What its products of velocities leave of the hull: they explain {hull_terms.percent(of)} "
        "over the training data.",
        "How inertia in yaw and added inertia share their sum: a radius of gyration of L/4 is "
        "taken.",
        "Heave, roll and pitch: their buoyancy and damping are the model's own.",
    ))  # fmt: skip


def compare(job: Job, path: Path) -> Difference:
    """Raises NotLoaded."""
    raise NotLoaded(
        "it is not installed here; the names and signs are those of gz-sim 8's Hydrodynamics.cc"
    )


def version() -> str:
    return ""
