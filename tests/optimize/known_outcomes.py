"""Outcomes known beforehand, to search among."""

from dataclasses import dataclass, field

import numpy as np


@dataclass
class Table:
    """Outcomes known beforehand, shape (designs, runs); remembers what it was asked."""

    rows: np.ndarray
    n_asked: dict[int, int] = field(default_factory=dict)
    n_hinted: int = 0
    interrupted_after: float = np.inf

    def scores(self, design, n_runs):
        self.interrupted_after -= 1
        if self.interrupted_after < 0:
            raise KeyboardInterrupt
        self.n_asked[design] = max(n_runs, self.n_asked.get(design, 0))
        return self.rows[design, :n_runs]

    def prefetch(self, requests):
        self.n_hinted += len(requests)


def draw(pass_probabilities, seed, n_runs=1000):
    p = np.asarray(pass_probabilities)
    return np.random.Generator(np.random.PCG64(seed)).random((len(p), n_runs)) < p[:, None]
