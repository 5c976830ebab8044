"""Errors that a user's input may cause, worded alike."""

import math
from pathlib import Path


class StudyError(ValueError):
    """Bad input in a study: one line that names the file, the key, what was found and what is allowed.

    Parameters
    ----------
    problem : what is wrong, with the value found and what is allowed.
    file : the file at fault, if there is one.
    key : the dotted path of the key in that file, if there is one.
    """

    def __init__(self, problem: str, *, file: str | Path | None = None, key: str | None = None):
        self.file = None if file is None else str(file)
        self.key = key
        self.problem = " ".join(problem.split())
        super().__init__(": ".join(part for part in (self.file, self.key, self.problem) if part))


def require_finite(name: str, value: float, *, low: float, high: float, is_low_open: bool = False) -> None:
    """Raise ValueError unless low <= value <= high (low < value if `is_low_open`) and value is finite."""
    is_inside = math.isfinite(value) and value <= high and (value > low if is_low_open else value >= low)
    if not is_inside:
        bracket = "above" if is_low_open else "at least"
        raise ValueError(f"{name} is {value!r}, must be {bracket} {low:g} and at most {high:g}")
