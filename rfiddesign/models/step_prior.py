"""Read probability from how often a tag was read: the Bayes estimate of uhf_snapshots (eqs. 2 to 4 and 6)."""

from dataclasses import dataclass

import numpy as np
from scipy.special import beta, betainc

from rfiddesign import require

# Of a snapshot, as in `snapshots`.
MAX_CYCLES = 1000


@dataclass(frozen=True)
class StepPrior:
    """Prior of the chance q that a tag is read in one cycle: one density below `threshold`, another above.

    Most tags are out of reach of most places, hence the mass near 0 (uhf_snapshots, section IV-A).

    Parameters
    ----------
    threshold : where the density steps.
    mass_below : probability that q is below it.
    """

    threshold: float = 1e-3
    mass_below: float = 0.8

    def __post_init__(self) -> None:
        require.within("threshold", self.threshold, low=0.0, high=0.999, is_low_open=True)
        require.within("mass_below", self.mass_below, low=0.0, high=0.999, is_low_open=True)

    @property
    def densities(self) -> tuple[float, float]:
        """Density below and above the threshold."""
        return self.mass_below / self.threshold, (1.0 - self.mass_below) / (1.0 - self.threshold)

    @property
    def mean(self) -> float:
        """The chance expected where nothing was ever measured (eq. 6)."""
        return 0.5 * self.mass_below * self.threshold + 0.5 * (1.0 - self.mass_below) * (1.0 + self.threshold)

    def estimates(self, n_cycles: int) -> np.ndarray:
        """Expected chance after 0, 1, ... `n_cycles` reads in as many cycles (eqs. 2 to 4), shape (n_cycles + 1,).

        Prior and binomial make incomplete beta functions: over [a, b] the integral of q^f (1 - q)^(N - f) is
        B(f + 1, N - f + 1) times the difference of the regularized ones at b and a.
        """
        require.count("n_cycles", n_cycles, at_most=MAX_CYCLES)
        f = np.arange(n_cycles + 1.0)
        return self._mass(f + 2, n_cycles - f + 1) / self._mass(f + 1, n_cycles - f + 1)

    def _mass(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """Integral of the prior times q^(a - 1) (1 - q)^(b - 1)."""
        low, high = self.densities
        below = betainc(a, b, self.threshold)
        return beta(a, b) * (low * below + high * (1.0 - below))
