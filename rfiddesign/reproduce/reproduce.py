"""Run a reproduction: measure what its kind measures, and hold its claims against the numbers."""

from dataclasses import dataclass
from typing import Any

from matplotlib.figure import Figure

from rfiddesign.reproduce.kinds import KINDS
from rfiddesign.reproduce.progress import OnProgress
from rfiddesign.reproduce.reproduction import Reproduction
from rfiddesign.reproduce.rows import Claim, Row


@dataclass(frozen=True)
class Reproduced:
    """What a reproduction found.

    Parameters
    ----------
    name, title : of the study.
    is_quick : whether counts were reduced.
    rows : every number, published or not.
    claims : bounds of expected.toml, held against the numbers.
    figures : by name.
    files : texts to be written beside them, by file name.
    """

    name: str
    title: str
    is_quick: bool
    rows: tuple[Row, ...]
    claims: tuple[Claim, ...]
    figures: dict[str, Figure]
    files: dict[str, str]

    def as_json(self) -> dict[str, Any]:
        """Numbers and claims as plain data."""
        return {
            "study": self.name,
            "title": self.title,
            "is_quick": self.is_quick,
            "rows": [row.as_json() for row in self.rows],
            "claims": [claim.as_json() for claim in self.claims],
        }


def reproduce(
    loaded: Reproduction, *, is_quick: bool = False, n_workers: int | None = None,
    on_progress: OnProgress | None = None,
) -> Reproduced:  # fmt: skip
    """Run a reproduction.

    Results depend on the study and its seed alone, not on the number of workers; times are those of this machine.

    Parameters
    ----------
    is_quick : the reduced number of runs.
    n_workers : threads; None: one per core.
    on_progress : called with what is under way, how many of its runs are done and how many there are.
    """
    kind = KINDS[loaded.file.kind]
    found = kind.measure(loaded, n_workers, on_progress or (lambda *_: None), is_quick=is_quick)
    measured = {(row.table, row.row, row.metric): row.measured for row in found.rows}
    claims = tuple(
        Claim(claim, measured.get((claim.table, claim.row, claim.metric))) for claim in loaded.expected.claims
    )
    return Reproduced(loaded.name, loaded.file.title, is_quick, tuple(found.rows), claims, found.figures, found.files)
