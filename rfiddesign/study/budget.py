"""What a search may spend in runs and in minutes, shared out among the answers that it looks for."""

import time
from collections.abc import Callable
from dataclasses import dataclass


@dataclass
class Budget:
    """A budget of a whole study.

    Parameters
    ----------
    n_runs : runs at most; None: as many as it takes.
    minutes : minutes at most from `start` on; None: as long as it takes.
    clock : tells the time [s].
    """

    n_runs: int | None
    minutes: float | None
    clock: Callable[[], float] = time.monotonic

    def __post_init__(self) -> None:
        self._begin: float | None = None

    @property
    def is_short(self) -> bool:
        """Whether there is any limit."""
        return self.n_runs is not None or self.minutes is not None

    def start(self) -> None:
        """Let the time run, unless it does."""
        if self._begin is None:
            self._begin = self.clock()

    def spend(self, n_runs: int) -> None:
        """Take runs off what is left."""
        if self.n_runs is not None:
            self.n_runs = max(0, self.n_runs - n_runs)

    def runs_for_one_of(self, n_left: int) -> int | None:
        """Runs for the next of so many searches: an equal share of what is left."""
        return None if self.n_runs is None else self.n_runs // n_left

    def time_for_one_of(self, n_left: int, share: float = 1.0) -> Callable[[], float] | None:
        """What tells the share used of the time for the next of so many searches, counted from now.

        `share` : of an equal part of what is left.
        """
        if self.minutes is None:
            return None
        self.start()
        now = self.clock()
        allowed = max(0.0, self._begin + 60 * self.minutes - now) * share / n_left
        return lambda: (self.clock() - now) / allowed if allowed > 0 else 1.0
