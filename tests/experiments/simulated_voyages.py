"""Orders, and what a voyage of the simulated ship and its log hold."""

import math
from datetime import UTC, datetime

import numpy as np
import pymap3d
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

from pipelines.experiments.simulated_ship import (
    Wind,
)
from pipelines.experiments.simulated_ship.sensors import DATUM
from pipelines.experiments.simulated_ship.ship import ANTENNA

START = datetime(2025, 10, 7, 1, 0, tzinfo=UTC)
STEADY = Wind(4.0, 0.7, gust=0.0, veer=0.0, wander=0.0)
STATE = ("x0", "surge", "y0", "sway", "heading", "yaw_rate")


def hold(port_deg: float, starboard_deg: float, propeller: float):
    return lambda time, state: (math.radians(port_deg), math.radians(starboard_deg), propeller)


def state(voyage) -> np.ndarray:
    return np.column_stack([getattr(voyage, name) for name in STATE])


def topics(path) -> dict[str, dict[str, np.ndarray]]:
    """Topic -> field -> values, and the times as `t` [s from START]."""
    rows: dict[str, list] = {}
    with open(path, "rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        for _, channel, message, proto in reader.iter_decoded_messages():
            rows.setdefault(channel.topic, []).append((message, proto))
    found = {}
    for topic, pairs in rows.items():
        names = [d.name for d in pairs[0][1].DESCRIPTOR.fields if d.type == d.TYPE_DOUBLE]
        scalars = [name for name in names if name != "position_covariance"]
        found[topic] = {n: np.array([getattr(p, n) for _, p in pairs]) for n in scalars}
        zero = int(START.timestamp()) * 10**9
        found[topic]["t"] = np.array([p.timestamp.ToNanoseconds() - zero for _, p in pairs]) / 1e9
        found[topic]["late"] = np.array(
            [m.log_time - p.timestamp.ToNanoseconds() for m, p in pairs]
        )
    return found


def local(found) -> tuple[np.ndarray, np.ndarray]:
    """North and east [m] of the fixes, by pymap3d."""
    fix = found["/gnss/fix"]
    east, north, _ = pymap3d.geodetic2enu(fix["latitude"], fix["longitude"], 0.0, *DATUM, 0.0)
    return north, east


def antenna_path(voyage) -> tuple[np.ndarray, np.ndarray]:
    at = voyage.x0 + 1j * voyage.y0 + complex(*ANTENNA) * np.exp(1j * voyage.heading)
    return at.real, at.imag
