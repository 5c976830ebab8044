"""Where a study stands, for whoever shows progress."""

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Stage:
    """What is being done, and the counts of a search while one goes on."""

    what: str
    n_refuted: int = 0
    n_racing: int = 0
    n_remaining: int = 0
    n_runs: int = 0


OnStage = Callable[[Stage], None]
