"""Between the program's own units (mm, rad, s, cents) and those that people read."""

import math

MM2_PER_M2 = 1e6
DEG_PER_RAD = 180.0 / math.pi
CENTS_PER_UNIT = 100


def flops(number: float) -> str:
    """A count of floating-point operations, as "about 52 thousand floating-point operations"."""
    for size, name in ((1e9, "billion "), (1e6, "million "), (1e3, "thousand ")):
        if number >= size:
            return f"about {number / size:.3g} {name}floating-point operations"
    return f"about {number:.3g} floating-point operations"


def money(cents: int, currency: str) -> str:
    """An exact amount, as "EUR 123,456.78"."""
    sign = "-" if cents < 0 else ""
    return f"{currency} {sign}{abs(cents) // CENTS_PER_UNIT:,}.{abs(cents) % CENTS_PER_UNIT:02d}"
