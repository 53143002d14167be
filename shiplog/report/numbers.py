"""Numbers as sentences have them."""

from __future__ import annotations


def counted(number: int, noun: str) -> str:
    """`1 window`, `2 windows`."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def figure(value: float, digits: int = 2) -> str:
    """With so many significant digits. A large number keeps its zeros: 12000, and not 1.2e+04."""
    rounded = float(f"{value:.{digits}g}")
    return f"{rounded:.0f}" if abs(rounded) >= 10.0**digits else f"{value:.{digits}g}"
