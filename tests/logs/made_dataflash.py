"""DataFlash logs written by ArduPilot's documented layout (libraries/AP_Logger/README.md), and the
circle of `circle_layouts` in one. Nothing here is shared with the reader."""

import struct

import numpy as np
from circle_layouts import RATE, SPEED, Voyage

STRUCT = {
    "a": "64s", "b": "b", "B": "B", "h": "h", "H": "H", "i": "i", "I": "I", "f": "f", "d": "d",
    "n": "4s", "N": "16s", "Z": "64s", "c": "h", "C": "H", "e": "i", "E": "I", "L": "i", "M": "B",
    "q": "q", "Q": "Q", "g": "e",
}  # fmt: skip
FORMATS = {  # name: number, letters, labels, units, multipliers; as ArduPilot 4.5 has them
    "FMTU": (129, "QBNN", "TimeUS,FmtType,UnitIds,MultIds", "s---", "F---"),
    "UNIT": (130, "QbZ", "TimeUS,Id,Label", "s--", "F--"),
    "MULT": (131, "Qbd", "TimeUS,Id,Mult", "s--", "F--"),
    "PARM": (132, "QNff", "TimeUS,Name,Value,Default", "s---", "F---"),
    "MSG": (133, "QZ", "TimeUS,Message", "s-", "F-"),
    "GPS": (134, "QBBIHBcLLeffffB",
            "TimeUS,I,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt,Spd,GCrs,VZ,Yaw,U",
            "s#-s-S-DUmnhnh-", "F--C-0BGGB000--"),
    "GPA": (135, "QBCCCCfBIHeHH",
            "TimeUS,I,VDop,HAcc,VAcc,SAcc,YAcc,VV,SMS,Delta,AEl,RTCMFU,RTCMFD",
            "s#-mmnd-ssm--", "F-BBBB0-CCB--"),
    "ATT": (136, "QffffffB", "TimeUS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw,AEKF",
            "sddddhh-", "F000000-"),
    "IMU": (137, "QBffffff", "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ", "s#EEEooo", "F-000000"),
    "RCOU": (138, "QHHHHHHHHHHHHHH", "TimeUS," + ",".join(f"C{n}" for n in range(1, 15)),
             "sYYYYYYYYYYYYYY", "F--------------"),
    "POS": (139, "QLLfff", "TimeUS,Lat,Lng,Alt,RelHomeAlt,RelOriginAlt", "sDUmmm", "FGG000"),
    "XKF1": (140, "QBccCfffffffccce", "TimeUS,C,Roll,Pitch,Yaw,VN,VE,VD,dPD,PN,PE,PD,GX,GY,GZ,OH",
             "s#ddhnnnnmmmkkkm", "F-BBB0000000BBBB"),
    "NTUN": (141, "QfffHf", "TimeUS,WpDist,WpBrg,DesYaw,Yaw,XTrack", "smhhdm", "F000B0"),
    "WIND": (142, "Qffffff", "TimeUS,DirRaw,DirApp,DirTrue,SpdRaw,SpdApp,SpdTrue", "sdddnnn",
             "F000000"),
    "RCO2": (143, "QHHHH", "TimeUS,C15,C16,C17,C18", "sYYYY", "F----"),
    "XKF4": (144, "QBcccccfffHBIHb",
             "TimeUS,C,SV,SP,SH,SM,SVT,errRP,OFN,OFE,FS,TS,SS,GPS,PI", "s#------mm-----",
             "F-------??-----"),
}  # fmt: skip
UNITS = {"s": "s", "D": "deglatitude", "U": "deglongitude", "m": "m", "n": "m/s", "d": "deg",
         "h": "degheading", "k": "deg/s", "E": "rad/s", "o": "m/s/s", "Y": "us", "#": "instance",
         "S": "satellites", "-": ""}  # fmt: skip
MULTS = {"-": 0.0, "?": 1.0, "0": 1.0, "B": 1e-2, "C": 1e-3, "F": 1e-6, "G": 1e-7}
GPS_EPOCH, LEAP = 315_964_800, 18


def fmt(number: int, name: str, letters: str, labels: str) -> bytes:
    size = 3 + struct.calcsize("<" + "".join(STRUCT[letter] for letter in letters))
    head = struct.pack("<BB", number, size)
    return (
        b"\xa3\x95\x80"
        + head
        + struct.pack("<4s16s64s", name.encode(), letters.encode(), labels.encode())
    )


def record(name: str, *values, formats=FORMATS) -> bytes:
    """Values as they are stored: whole numbers where the letter is one."""
    number, letters = formats[name][:2]
    packed = [value.encode() if isinstance(value, str) else value for value in values]
    return (
        b"\xa3\x95"
        + bytes([number])
        + struct.pack("<" + "".join(STRUCT[letter] for letter in letters), *packed)
    )


def header(names=tuple(FORMATS), formats=FORMATS, described=True) -> bytes:
    out = fmt(0x80, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns")
    for name in dict.fromkeys((*(("FMTU", "UNIT", "MULT") if described else ()), *names)):
        number, letters, labels, _, _ = formats[name]
        out += fmt(number, name, letters, labels)
    if not described:
        return out
    for letter, unit in UNITS.items():
        out += record("UNIT", 1, ord(letter), unit, formats=formats)
    for letter, factor in MULTS.items():
        out += record("MULT", 1, ord(letter), factor, formats=formats)
    for name in names:
        number, _, _, units, mults = formats[name]
        out += record("FMTU", 1, number, units, mults, formats=formats)
    return out


def gps_time(unix: float) -> tuple[int, int]:
    """Week and ms of it; two moments of one ms are the same."""
    ms = round((unix - GPS_EPOCH + LEAP) * 1000)
    return ms // 604_800_000, ms % 604_800_000


BLUEBOAT = {  # SERVOn_*: two thrusters, a gripper on 3, nothing on the others
    "SERVO1_FUNCTION": 73, "SERVO1_MIN": 1100, "SERVO1_MAX": 1900, "SERVO1_TRIM": 1500,
    "SERVO1_REVERSED": 0, "SERVO2_FUNCTION": 0, "SERVO3_FUNCTION": 74, "SERVO3_MIN": 1000,
    "SERVO3_MAX": 2000, "SERVO3_TRIM": 1500, "SERVO3_REVERSED": 1, "SERVO4_FUNCTION": 28,
    "GPS1_POS_X": 0.3, "GPS1_POS_Y": -0.1, "GPS1_POS_Z": 0.0,
}  # fmt: skip
BOOT_S = 100.0  # after the start, when the voyage begins
LATE_US = 150_000  # from a fix to its record


def left_us(v: Voyage) -> np.ndarray:
    return np.round(1500.0 + 300.0 * np.sin(0.1 * v.t))


def right_us(v: Voyage) -> np.ndarray:
    return np.round(1500.0 - 400.0 * np.sin(0.07 * v.t))


def circle(v: Voyage | None = None, parameters=BLUEBOAT, second=True) -> bytes:
    """The circle at 10 Hz, as a boat with ArduPilot 4.5 logs it: a first second without a fix, a
    second receiver that is not used, and an IMU of another rate."""
    v = v or Voyage()
    boot = np.round((BOOT_S + v.t) * 1e6).astype(np.int64)
    out = [header()]
    out += [record("PARM", 1000 + i, name, value, float("nan"))
            for i, (name, value) in enumerate(parameters.items())]  # fmt: skip
    rows: list[tuple[int, bytes]] = []
    for i in range(10):  # before the first fix: a week and a time of no meaning
        at = int(boot[0]) - 1_200_000 + 100_000 * i
        rows.append((at, record("GPS", at, 0, 1, 5000 + i, 1000, 0, 9999, 0, 0, 0, 0.0, 0.0, 0.0,
                                0.0, 1)))  # fmt: skip
    left, right = left_us(v), right_us(v)
    for i in range(len(v.t)):
        at, late = int(boot[i]), int(boot[i]) + LATE_US + (i % 5) * 7000
        week, ms = gps_time(v.unix[i])
        lat, lng = (round(1e7 * x) for x in (v.latitude[i], v.longitude[i]))
        fix = (week, 12, 65, lat, lng, 250, SPEED, v.course_deg[i], 0.0, 0.0)
        rows.append((late, record("GPS", late, 0, 3, ms, *fix, 1)))
        rows.append((late, record("GPA", late, 0, 120, 80, 130, 12, 0.0, 1, at // 1000, 100,
                                  4000, 0, 0)))  # fmt: skip
        if second:
            other = (week, 9, 90, lat + 40, lng, 250, SPEED, v.course_deg[i], 0.0, 0.0)
            rows.append((late, record("GPS", late, 1, 3, ms, *other, 0)))
        rows.append((at, record("ATT", at, 0.0, 0.1, 0.0, 0.2, 0.0, v.heading_deg[i], 3)))
        rows.append((at, record("IMU", at, 0, 0.0, 0.0, RATE, 0.0, 0.0, -9.8)))
        rows.append((at, record("IMU", at, 1, 0.0, 0.0, RATE + 0.01, 0.0, 0.0, -9.8)))
        pulses = [int(left[i]), 0, int(right[i]), 1500, *(0,) * 10]
        rows.append((at + 3000, record("RCOU", at, *pulses)))
        from_bow = (v.wind_angle[i] + 180.0) % 360.0 - 180.0
        rows.append((at, record("WIND", at, 0.0, from_bow, 0.0, 0.0, v.wind_speed[i], 0.0)))
    out += [raw for _, raw in sorted(rows, key=lambda row: row[0])]
    return b"".join(out)
