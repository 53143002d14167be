#!/usr/bin/env bash
# MCSimPython 0.1.6: a wave spectrum made with freq_hz=True multiplies the caller's array of
# frequencies by 2 pi in place. A second spectrum of the same array multiplies it again, for both: the
# first one, whose significant wave height was the 2 m that it was asked for, then has 0.3 m, as
# its peak is below all of its frequencies. A guess would be 2 m both times, and the array as it was.
#
# Seen: "JONSWAP of 2 m: 2.00 m, after a second spectrum 0.29 m; lowest frequency 0.05 Hz has become
# 1.97".
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q 'MCSimPython==0.1.6' 'numpy==2.4.6' 'scipy==1.17.1'
"$work/venv/bin/python" - <<'P'
import numpy as np
from MCSimPython.waves.wave_spectra import JONSWAP, ModifiedPiersonMoskowitz


def height(spectrum: JONSWAP) -> float:
    frequencies, density = spectrum(2.0, 8.0, 3.3)  # significant height, peak period, gamma
    return float(4.0 * np.sqrt(np.trapezoid(density, frequencies)))


hertz = np.linspace(0.05, 0.5, 200)
spectrum = JONSWAP(hertz, freq_hz=True)
before = height(spectrum)
ModifiedPiersonMoskowitz(hertz, freq_hz=True)
after = height(spectrum)
print(
    f"JONSWAP of 2 m: {before:.2f} m, after a second spectrum {after:.2f} m; lowest frequency 0.05 Hz "
    f"has become {hertz[0]:.2f}"
)
assert abs(before - 2.0) < 0.01, before
assert round(after, 2) == 0.29 and round(hertz[0], 2) == 1.97, f"this has changed: {after}"
P
