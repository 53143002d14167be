"""What each sentence says: published examples, whose values are worked out by hand."""

import math

import numpy as np
import pynmea2
import pytest
from made_nmea import sentence

from shiplog.logs.conversion.nmea_ais import vdo
from shiplog.logs.conversion.nmea_lines import Lines
from shiplog.logs.conversion.nmea_sentences import SENTENCES, east_positive

KNOT = 1852.0 / 3600.0


def facts(line):
    """Topic to values and reason of a line with or without a checksum."""
    (one,) = Lines().accept(line)
    read = vdo if one.kind == "VDO" else SENTENCES[one.kind]
    return {fact.topic: (fact.values, fact.why_not) for fact in read(one.fields, one.vouched)}


EXAMPLES = {  # of the standard's text, receivers' manuals and Signal K's tests
    "$GPHDT,274.07,T*03": ("hdt", (274.07,)),
    "$HEHDT,344.9,T": ("hdt", (344.9,)),
    "$HCHDG,98.3,0.0,E,12.6,W*57": ("hdg", (98.3, -12.6, 0.0)),
    "$SDHDG,181.9,,,0.6,E*32": ("hdg", (181.9, 0.6, math.nan)),
    "$HCHDM,238.5,M": ("hdm", (238.5, math.nan, math.nan)),
    "$GPROT,35.6,A*01": ("/gyro/rate", (35.6 / 60,)),
    "$IIRSA,10.5,A,,V*4D": ("/rudder/starboard", (10.5,)),
    "$WIMWV,214.8,R,0.1,K,A*28": ("mwv_r", (0.1 / 3.6, 214.8)),
    "$IIVWR,75,R,1.0,N,0.51,M,1.85,K*6C": ("vwr", (KNOT, 75.0)),
    "$IIVWR,45,L,12.0,N,06.2,M,022.2,K": ("vwr", (12 * KNOT, 315.0)),
    "$IIVWT,030,R,10.1,N,05.2,M,018.7,K": ("vwt", (10.1 * KNOT, 30.0)),
    "$IIMWD,046.,T,046.,M,10.1,N,05.2,M": ("/wind/true_north", (10.1 * KNOT, 46.0)),
    "$IIVHW,245.1,T,245.1,M,000.01,N,000.01,K": ("/speed/water", (0.01 * KNOT,)),
    "$IIRPM,E,1,2418.2,10.5,A*5F": ("/propeller/engine_1", (2418.2 / 60,)),
    "$IIRPM,S,0,74.7,-30.0,A": ("/thruster/shaft_0_pitch", (-0.3,)),
    "$GPVTG,054.7,T,034.4,M,005.5,N,010.2,K*48": ("vtg", (5.5 * KNOT, 54.7)),
    "$GPGLL,4916.45,N,12311.12,W,225444,A": ("gll", (49 + 16.45 / 60, -(123 + 11.12 / 60))),
    "$GPGLL,2200.097,S,01756.346,W": ("gll", (-(22 + 0.097 / 60), -(17 + 56.346 / 60))),
    "$GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,*47":
        ("gga", (48 + 7.038 / 60, 11.0 + 31 / 60, 545.4)),
    "$GPRMC,123519,A,4807.038,N,01131.000,E,022.4,084.4,230394,003.1,W*6A": ("variation", (-3.1,)),
    "$GPRMC,081836,A,3751.65,S,14507.36,E,000.0,360.0,130998,011.3,E*62":
        ("rmc", (-(37 + 51.65 / 60), 145 + 7.36 / 60)),
    "$GNGNS,014035.00,4332.69262,S,17235.48549,E,RR,13,0.9,25.63,11.24,,*70":
        ("gns", (-(43 + 32.69262 / 60), 172 + 35.48549 / 60, 25.63)),
}  # fmt: skip


@pytest.mark.parametrize("line", EXAMPLES)
def test_a_published_sentence_says_what_it_says(line):
    topic, values = EXAMPLES[line]
    found, why_not = facts(line)[topic]
    np.testing.assert_allclose(found, values, rtol=1e-12, atol=1e-12)
    assert why_not == ""


def test_true_headings_by_pynmea2_are_the_same():
    """Numbers and places by another reader of the same lines."""
    rng = np.random.default_rng(0)
    for _ in range(200):
        lat, lon = rng.uniform(0, 89), rng.uniform(0, 179)
        where = f"{int(lat):02d}{lat % 1 * 60:08.5f},{'NS'[rng.integers(2)]},"
        where += f"{int(lon):03d}{lon % 1 * 60:08.5f},{'EW'[rng.integers(2)]}"
        line = sentence(f"GPGGA,{rng.integers(10):02d}0101.00,{where},1,9,0.9,{lat:.2f},M,0,M,,")
        other = pynmea2.parse(line)
        found, _ = facts(line)["gga"]
        assert found == pytest.approx((other.latitude, other.longitude, float(other.altitude)))


def test_a_minus_before_a_western_longitude_says_west_once():
    line = "$GPGLL,-0530.000,S,-01000.000,W,101010,A"
    assert facts(line)["gll"][0] == (-5.5, -10.0)
    with pytest.raises(ValueError, match="E"):
        facts("$GPGLL,0530.000,N,-01000.000,E,101010,A")
    assert (east_positive("-3.2", "W"), east_positive("3.2", "W")) == (-3.2, -3.2)
    assert east_positive("3.2", "E") == 3.2
    assert math.isnan(east_positive("3.2", ""))


@pytest.mark.parametrize(
    ("line", "kind"),
    [("$GNRMC,101010,A,-3745.6000,S,-12227.0000,W,0.1,0.0,230324,,,A", "rmc"),
     ("$GNGGA,101010,-3745.6000,S,-12227.0000,W,4,12,0.7,3.0,M,,M,,", "gga"),
     ("$GPGLL,-3745.6000,S,-12227.0000,W,101010,A", "gll"),
     ("$GNGNS,101010,-3745.6000,S,-12227.0000,W,AA,12,0.7,3.0,,,", "gns")],
)  # fmt: skip
def test_a_minus_and_a_letter_are_one_sign_in_every_sentence(line, kind):
    found = facts(line)
    (place,) = [value for name, value in found.items() if name in (kind, "fix")]
    numbers = [n for n in np.ravel(np.array(place[0], float))][:2]
    assert numbers == pytest.approx([-37.76, -122.45])


NOT_MEASURED = {
    "$GPGGA,123519,4807.038,N,01131.000,E,0,00,,,M,,M,,": ("gga", "no fix"),
    "$GPGGA,123519,4807.038,N,01131.000,E,6,00,,,M,,M,,": ("gga", "dead reckoning"),
    "$GPGGA,123519,4807.038,N,01131.000,E,7,00,,,M,,M,,": ("gga", "manual"),
    "$GPGGA,123519,4807.038,N,01131.000,E,8,08,1,0,M,,M,,": ("gga", "simulator"),
    "$GPGGA,123519,0000.000,N,00000.000,E,1,08,1,0,M,,M,,": ("gga", "0 N, 0 E"),
    "$GPRMC,123519,V,4807.038,N,01131.000,E,1,84.4,230324,,,N": ("rmc", "no fix"),
    "$GPRMC,123519,A,4807.038,N,01131.000,E,1,84.4,230324,,,E": ("rmc_velocity", "dead reckoning"),
    "$GPRMC,123519,A,4807.038,N,01131.000,E,1,84.4,230324,,,S": ("rmc", "simulator"),
    "$GPRMC,123519,A,4807.038,N,01131.000,E,1,84.4,230324,,,M": ("rmc", "manual"),
    "$GPVTG,054.7,T,034.4,M,005.5,N,010.2,K,E": ("vtg", "dead reckoning"),
    "$GPGLL,4916.45,N,12311.12,W,225444,V": ("gll", "no valid"),
    "$GPGLL,4916.45,N,12311.12,W,225444,A,N": ("gll", "no fix"),
    "$GNGNS,014035.00,4332.69,S,17235.48,E,NN,13,0.9,25.63,11.24,,": ("gns", "no fix"),
    "$GNGNS,014035.00,4332.69,S,17235.48,E,EE,13,0.9,25.63,11.24,,": ("gns", "dead reckoning"),
    "$HETHS,123.4,E": ("ths", "dead reckoning"), "$HETHS,123.4,S": ("ths", "simulator"),
    "$HETHS,123.4,V": ("ths", "no valid"), "$TIROT,3.0,V": ("/gyro/rate", "no valid"),
    "$AGRSA,5.0,V,4.0,A": ("/rudder/starboard", "no valid"),
    "$ERRPM,S,1,90.0,40.0,V": ("/propeller/shaft_1", "no valid"),
    "$WIMWV,30.0,R,10.0,K,V": ("mwv_r", "no valid"),
}  # fmt: skip


@pytest.mark.parametrize("line", NOT_MEASURED)
def test_what_an_instrument_calls_no_measurement(line):
    topic, word = NOT_MEASURED[line]
    assert word in facts(line)[topic][1]


@pytest.mark.parametrize(
    "line",
    ["$GPRMC,123519,A,4807.038,N,01131.000,E,1,84.4,230324,,,D",
     "$GPRMC,123519,A,4807.038,N,01131.000,E,1,84.4,230324,,,R",
     "$GPRMC,123519,A,4807.038,N,01131.000,E,1,84.4,230324,,,F",
     "$GPRMC,123519,A,4807.038,N,01131.000,E,1,84.4,230324",  # before 2.3
     "$GPGGA,165110.00,5601.0318,N,01211.3503,E,2,04,2.95,007,M,041,M,,",  # blank DGPS
     "$GPGGA,123519,4807.038,N,01131.000,E,3,08,1,0,M,,M,,",
     "$GNGNS,014035.00,4332.69,S,17235.48,E,NA,13,0.9,25.63,11.24,,", "$HETHS,123.4,A"],
)  # fmt: skip
def test_what_is_a_measurement(line):
    assert {why for _, why in facts(line).values()} == {""}


@pytest.mark.parametrize(
    "cut",
    ["$HEHDT,34", "$HEHDT,345.0", "$HEHDT,345.0,", "$AGRSA,-5", "$AGRSA,-5.0", "$AGRSA,1.0,A,4",
     "$HCHDG,98.3,0.0,E,12", "$HCHDG,98.3,0.0", "$TIROT,35", "$WIMWV,214.8,R,1",
     "$WIMWV,214.8,R,10.1,K", "$IIVWR,75,R,1", "$IIVHW,24", "$ERRPM,S,0,7", "$ERRPM,S,0,74.7,10",
     "$GPVTG,054.7,T,034.4,M,00", "$GPGGA,123519,4807.0", "$HETHS,12",
     "$GPRMC,123519,A,4807.038,N,01131.000,E,022.4,0", "$IIMWD,046.,T,046.,M,1",
     "$GPGLL,4916.45,N,123"],
)  # fmt: skip
def test_a_sentence_that_is_cut_gives_no_number(cut):
    with pytest.raises((ValueError, IndexError)):
        facts(cut)


@pytest.mark.parametrize("field", ["nan", "1e5", "inf", "1_0", "12x", "1.2.3", "-1.-3"])
def test_what_python_takes_for_a_number_and_no_instrument_sends(field):
    with pytest.raises(ValueError, match=r".*"):
        facts(f"$HEHDT,{field},T")


def test_the_own_ship_of_an_ais_transponder():
    """Bits laid down by hand: type 1, 9.9 kn, 5.5 deg N, 10 deg W, course 341.5, heading 32."""
    fields = [(1, 6), (0, 2), (211_000_000, 30), (0, 4), (0, 8), (99, 10), (0, 1),
              (-10 * 600_000, 28), (5 * 600_000 + 300_000, 27), (3415, 12), (32, 9), (12, 6),
              (0, 2), (0, 3), (0, 1), (0, 19)]  # fmt: skip
    bits = "".join(format(value % (1 << width), f"0{width}b") for value, width in fields)
    six = [int(bits[i : i + 6], 2) for i in range(0, 168, 6)]
    text = "".join(chr(v + 48 + (8 if v > 39 else 0)) for v in six)
    found = facts(sentence(f"AIVDO,1,1,,A,{text},0", "!"))
    assert found["vdo"][0] == (5.5, -10.0)
    assert found["vdo_velocity"][0] == (pytest.approx(9.9 * KNOT), 341.5)
    assert found["vdo_heading"][0] == (32.0,)
    none = "".join(format(value % (1 << width), f"0{width}b") for value, width in [
        *fields[:5], (1023, 10), (0, 1), (181 * 600_000, 28), (91 * 600_000, 27), (3600, 12),
        (511, 9), *fields[11:]])  # fmt: skip
    six = [int(none[i : i + 6], 2) for i in range(0, 168, 6)]
    text = "".join(chr(v + 48 + (8 if v > 39 else 0)) for v in six)
    found = facts(sentence(f"AIVDO,1,1,,A,{text},0", "!"))
    assert all(math.isnan(value) for values, _ in found.values() for value in values)
