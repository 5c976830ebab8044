"""Bounds that constructors check: one line that names argument, value and what is allowed."""

import math

import numpy as np


def _number(argument: str, value: object, allowed: str) -> float:
    if isinstance(value, bool | str | bytes):
        raise ValueError(f"{argument} = {value!r}: must be {allowed}")
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise ValueError(f"{argument} = {value!r}: must be {allowed}") from None
    except OverflowError:
        raise ValueError(f"{argument}: has more digits than any float, must be {allowed}") from None
    if not math.isfinite(number):
        raise ValueError(f"{argument} = {value!r}: must be {allowed}")
    return number


def finite(argument: str, value: object) -> float:
    """Return `value` as a float, or raise ValueError unless it is a finite number."""
    return _number(argument, value, "a finite number")


def positive(argument: str, value: object) -> float:
    """Return `value` as a float, or raise ValueError unless it is a finite number above 0."""
    number = _number(argument, value, "a finite number above 0")
    if number <= 0:
        raise ValueError(f"{argument} = {value!r}: must be a finite number above 0")
    return number


def not_negative(argument: str, value: object) -> float:
    """Return `value` as a float, or raise ValueError unless it is a finite number of at least 0."""
    number = _number(argument, value, "a finite number of at least 0")
    if number < 0:
        raise ValueError(f"{argument} = {value!r}: must be a finite number of at least 0")
    return number


def count(argument: str, value: object, *, at_most: int) -> int:
    """Return `value` as an int, or raise ValueError unless it is a whole number from 1 to `at_most`."""
    number = _number(argument, value, f"a whole number from 1 to {at_most}")
    if number != int(number) or not 1 <= number <= at_most:
        raise ValueError(f"{argument} = {value!r}: must be a whole number from 1 to {at_most}")
    return int(number)


def seed(argument: str, value: object) -> int:
    """Return `value` as an int, or raise ValueError unless it is a whole number from 0 to 2^63 - 1."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or not 0 <= value < 2**63:
        raise ValueError(f"{argument} = {value!r}: must be a whole number from 0 to 2^63 - 1")
    return int(value)


def within(name: str, value: float, *, low: float, high: float, is_low_open: bool = False) -> None:
    """Raise ValueError unless low <= value <= high (low < value if `is_low_open`) and value is finite."""
    is_inside = math.isfinite(value) and value <= high and (value > low if is_low_open else value >= low)
    if not is_inside:
        bracket = "above" if is_low_open else "at least"
        raise ValueError(f"{name} is {value!r}, must be {bracket} {low:g} and at most {high:g}")
