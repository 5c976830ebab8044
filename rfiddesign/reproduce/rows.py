"""Rows of a reproduction: what was published beside what was measured."""

import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from rfiddesign.reproduce.config import ClaimSection

SIGNIFICANT_DIGITS = 6
# Units by the suffix of a metric's name.
_UNITS = {
    "_mm": "mm",
    "_mrad": "mrad",
    "_rad": "rad",
    "_deg": "deg",
    "_cm": "cm",
    "_m": "m",
    "_ms": "ms",
    "_s": "s",
    "_mb": "MB",
}


@dataclass(frozen=True)
class Row:
    """One number of a table.

    Parameters
    ----------
    table, row, metric : where it stands.
    published : what was printed; None where it is withheld or there is nothing to print.
    measured, stderr : mean over runs and its standard error (None where there is none).
    unit : of all three.
    """

    table: str
    row: str
    metric: str
    published: float | None
    measured: float
    stderr: float | None
    unit: str

    def as_json(self) -> dict[str, Any]:
        """The row as plain data, to six significant digits."""
        return asdict(self) | {"measured": rounded(self.measured), "stderr": rounded(self.stderr)}


@dataclass(frozen=True)
class Claim:
    """A bound on a measured number, and whether it holds."""

    claim: ClaimSection
    measured: float | None

    @property
    def holds(self) -> bool:
        """Whether the number was measured and keeps the bound."""
        value, low, high = self.measured, self.claim.at_least, self.claim.at_most
        return value is not None and (low is None or value >= low) and (high is None or value <= high)

    def as_json(self) -> dict[str, Any]:
        """The claim as plain data."""
        return self.claim.model_dump() | {"measured": rounded(self.measured), "holds": self.holds}


def row_of(table: str, row: str, metric: str, values: np.ndarray, published: float | None = None) -> Row:
    """A row from one value per run; runs without a value (nan) do not count."""
    values = np.asarray(values, float)
    values = values[~np.isnan(values)]
    stderr = float(values.std(ddof=1) / math.sqrt(values.size)) if values.size > 1 else None
    mean = float(values.mean()) if values.size else math.nan
    return Row(table, row, metric, published, mean, stderr, unit_of(metric))


def unit_of(metric: str) -> str:
    """Unit of a metric, by the suffix of its name; a variance has the square of it."""
    name, power = (metric.removesuffix("_var"), "^2") if metric.endswith("_var") else (metric, "")
    name = name.removesuffix("_max")
    if name == "us_per_step":
        return "us"
    for suffix, unit in _UNITS.items():
        if f"_{name}".endswith(suffix):
            return unit + power
    return "1"


def rounded(value: float | None) -> float | None:
    """A number to six significant digits; None for none and for what is not finite."""
    if value is None or not math.isfinite(value):
        return None
    return float(f"{value:.{SIGNIFICANT_DIGITS}g}")
