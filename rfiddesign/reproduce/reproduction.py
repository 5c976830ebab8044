"""A reproduction as read."""

from dataclasses import dataclass
from pathlib import Path

from rfiddesign.reproduce.config import ExpectedFile, ReproductionHead


@dataclass(frozen=True)
class Reproduction:
    """A reproduction as read.

    Parameters
    ----------
    path : its study file.
    file, expected : contents of its two files; the former by its kind, see `kinds`.
    """

    path: Path
    file: ReproductionHead
    expected: ExpectedFile

    @property
    def name(self) -> str:
        """Name of the folder."""
        return self.path.resolve().parent.name
