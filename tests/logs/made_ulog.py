"""ULog files written by the documented format (docs.px4.io, ULog File Format)."""

import math
import struct

import numpy as np
from circle_layouts import RATE, Voyage

PACK = {"int8_t": "b", "uint8_t": "B", "int16_t": "h", "uint16_t": "H", "int32_t": "i",
        "uint32_t": "I", "int64_t": "q", "uint64_t": "Q", "float": "f", "double": "d",
        "bool": "?"}  # fmt: skip
FORMATS = {  # as PX4 1.15 has them, in part
    "vehicle_gps_position": "uint64_t timestamp;uint64_t timestamp_sample;double latitude_deg;"
    "double longitude_deg;uint64_t time_utc_usec;float s_variance_m_s;float eph;float vel_n_m_s;"
    "float vel_e_m_s;float heading;uint8_t fix_type;uint8_t[7] _padding0",
    "vehicle_attitude": "uint64_t timestamp;uint64_t timestamp_sample;float[4] q;"
    "float[4] delta_q_reset;uint8_t quat_reset_counter;uint8_t[7] _padding0",
    "vehicle_angular_velocity": "uint64_t timestamp;uint64_t timestamp_sample;float[3] xyz",
    "actuator_motors": "uint64_t timestamp;uint64_t timestamp_sample;float[12] control;"
    "uint16_t reversible_flags;uint8_t[6] _padding0",
    "vehicle_local_position": "uint64_t timestamp;uint64_t timestamp_sample;float x;float y;"
    "float vx;float vy;int8_t xy_valid;int8_t v_xy_valid;uint8_t[2] _padding0",
}  # fmt: skip
OLD_GPS = (  # until 1.13
    "uint64_t timestamp;uint64_t time_utc_usec;int32_t lat;int32_t lon;int32_t alt;"
    "float s_variance_m_s;float eph;float vel_n_m_s;float vel_e_m_s;float heading;uint8_t fix_type"
)
BOOT_US = 20_000_000  # when the log begins


def message(kind: str, body: bytes) -> bytes:
    return struct.pack("<HB", len(body), ord(kind)) + body


def fmt(name: str, fields: str) -> bytes:
    return message("F", f"{name}:{fields}".encode())


def subscribe(number: int, name: str, instance=0) -> bytes:
    return message("A", struct.pack("<BH", instance, number) + name.encode())


def parameter(name: str, value: float) -> bytes:
    kind = "int32_t" if isinstance(value, int) else "float"
    key = f"{kind} {name}".encode()
    packed = struct.pack("<i" if kind == "int32_t" else "<f", value)
    return message("P", bytes([len(key)]) + key + packed)


def sample(number: int, fields: str, *values, padded=False) -> bytes:
    """Values of every field; the padding at the end is left out unless asked for."""
    body, at = struct.pack("<H", number), 0
    for text in fields.split(";"):
        kind, label = text.split(" ")
        base, _, count = kind.partition("[")
        many = int(count.rstrip("]")) if count else 0
        if label.startswith("_padding"):
            body += bytes(many) if padded else b""
            continue
        value = values[at]
        at += 1
        body += struct.pack(f"<{many or 1}{PACK[base]}", *(value if many else [value]))
    return message("D", body)


def header(start_us=BOOT_US, appended=()) -> bytes:
    flags = bytes(8) + bytes([1 if appended else 0]) + bytes(7)
    offsets = struct.pack("<3Q", *(*appended, *(0,) * (3 - len(appended))))
    head = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", start_us)
    return head + message("B", flags + offsets)


def quaternion(heading: float) -> list[float]:
    """w first, from the ship's axes to north-east-down, level."""
    return [math.cos(heading / 2), 0.0, 0.0, math.sin(heading / 2)]


def dropout(ms: int) -> bytes:
    return message("O", struct.pack("<H", ms))


def motors(v: Voyage) -> np.ndarray:
    """Two motors of twelve: the others are 0, as on rovers and boats."""
    controls = np.zeros((len(v.t), 12))
    controls[:, 0], controls[:, 1] = 0.5 * np.sin(0.1 * v.t), -0.3 * np.sin(0.07 * v.t)
    return controls


def circle(v: Voyage | None = None, parts=b"", padded=False) -> bytes:
    """The circle at 10 Hz: each sample is logged 4 ms after it was taken; the first of every topic
    is older than the log."""
    v = v or Voyage()
    names = list(FORMATS)
    out = header() + b"".join(fmt(name, FORMATS[name]) for name in names)
    out += parameter("EKF2_GPS_POS_X", 0.2) + parameter("EKF2_GPS_POS_Y", 0.1) + parts
    out += b"".join(subscribe(number, name) for number, name in enumerate(names))
    north, east = v.velocity
    controls = motors(v)
    for i in (-1, *range(len(v.t))):
        k = max(i, 0)
        taken = BOOT_US + 100_000 * i + 5_000
        at = taken + (4_000 if i >= 0 else 0)
        values = {
            "vehicle_gps_position": (v.latitude[k], v.longitude[k], round(v.unix[k] * 1e6), 0.1,
                                     0.8, north[k], east[k], math.nan, 3),
            "vehicle_attitude": (quaternion(v.heading[k]), [0.0] * 4, 0),
            "vehicle_angular_velocity": ([0.0, 0.0, RATE],),
            "actuator_motors": (list(controls[k]), 0),
            "vehicle_local_position": (v.north[k], v.east[k], north[k], east[k], 1, 1),
        }  # fmt: skip
        for number, name in enumerate(names):
            out += sample(number, FORMATS[name], at, taken, *values[name], padded=padded)
    return out
