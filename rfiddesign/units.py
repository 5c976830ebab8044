"""Between the program's own units (mm, rad, s, cents) and those that people read."""

import math

MM2_PER_M2 = 1e6
DEG_PER_RAD = 180.0 / math.pi
CENTS_PER_UNIT = 100


def money(cents: int, currency: str) -> str:
    """An exact amount, as "EUR 123,456.78"."""
    sign = "-" if cents < 0 else ""
    return f"{currency} {sign}{abs(cents) // CENTS_PER_UNIT:,}.{abs(cents) % CENTS_PER_UNIT:02d}"
