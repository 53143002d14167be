"""Numbers as sentences have them."""

from __future__ import annotations

NINETY_SPREADS = 1.645  # standard deviations to either end of a normal distribution's middle 90 %


def counted(number: int, noun: str) -> str:
    """`1 window`, `2 windows`."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def figure(value: float, digits: int = 2) -> str:
    """With so many significant digits. A large number keeps its zeros: 12000, and not 1.2e+04."""
    rounded = float(f"{value:.{digits}g}")
    return f"{rounded:.0f}" if abs(rounded) >= 10.0**digits else f"{value:.{digits}g}"


def in_minutes(degrees: float, letters: str, digits: int) -> str:
    """A latitude or longitude as on a chart, with so many decimals of a minute: 34.5125, "NS" is
    34°30.75'N."""
    minutes = round(abs(degrees) * 60, digits)
    whole, rest = divmod(minutes, 60)
    width = digits + 3 if digits else 2
    return f"{whole:.0f}°{rest:0{width}.{digits}f}'{letters[degrees < 0.0]}"


def percent(share: float) -> str:
    """Whole per cent; a part that would be rounded to nothing, or to all, has a decimal."""
    if 0.0 < share < 0.005:
        return f"{max(share, 0.001):.1%}"
    if 0.995 <= share < 1.0:
        return f"{min(share, 0.999):.1%}"
    return f"{share:.0%}"
