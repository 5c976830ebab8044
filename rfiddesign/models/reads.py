"""How readers read: the truth of a scenario, apart from what the estimator believes."""

from dataclasses import dataclass

import numpy as np

from rfiddesign import require

POLLINGS = ("common", "staggered")


@dataclass(frozen=True)
class ReadModel:
    """One tag per reader and poll, as the readers of hf_multireader_mcl (section 3: independent and asynchronous).

    Parameters
    ----------
    read_probability : chance that a poll with at least one tag in view returns a tag.
    polling : "common": all readers poll at the end of each step; "staggered": reader i of n polls at the fraction
        (i + 1/2)/n of the step, as a multiplexer would, so that its read is older when the filter sees it.
    """

    read_probability: float = 1.0
    polling: str = "common"

    def __post_init__(self) -> None:
        require.within("read_probability", self.read_probability, low=0.0, high=1.0)
        if self.polling not in POLLINGS:
            raise ValueError(f"polling is {self.polling!r}, must be one of {', '.join(POLLINGS)}")

    def phases(self, n_readers: int) -> np.ndarray:
        """Fraction of the step at which each reader polls, shape (n_readers,)."""
        if self.polling == "common":
            return np.ones(n_readers)
        return (np.arange(n_readers) + 0.5) / n_readers
