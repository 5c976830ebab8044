"""How readers read: the truth of a scenario, and what an estimator is told of it."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rfiddesign import require

POLLINGS = ("common", "staggered", "multiplexed")
ANSWERS = ("one", "all")
# Tags that one poll returns at most, where all in view answer.
MOST_ANSWERS = 64


class Schedule(NamedTuple):
    """When antennas poll: antenna a in every step t with t mod `period` = `slots[a]`, at its fraction `phases[a]`.

    Fields: slots (n,) int64; phases (n,) float64 in (0, 1]; period (int).
    """

    slots: np.ndarray
    phases: np.ndarray
    period: int


@dataclass(frozen=True)
class ReadModel:
    """Readers that poll in turn or at once, as those of hf_multireader_mcl (section 3: independent, asynchronous).

    Parameters
    ----------
    read_probability : chance that a poll with at least one tag in view returns a tag.
    polling : "common": all readers poll at the end of each step; "staggered": reader i of n polls at the fraction
        (i + 1/2)/n of the step, as fast multiplexers do, so that its read is older when the filter sees it;
        "multiplexed": the antennas take turns, `poll_s` each, over as many steps as that takes.
    poll_s : time of one poll of a multiplexer [s].
    read_time_s : a tag answers if it was in the field for this long before the end of the poll [s].
    delay_s : how late a read reaches the filter, which does not know of it unless told [s].
    answers : "one": a poll returns one of the tags in view, each with equal chance; "all": all of them, one by one, as
        an inventory with anti-collision does (each then read with `read_probability`).
    """

    read_probability: float = 1.0
    polling: str = "common"
    poll_s: float = 0.01
    read_time_s: float = 0.0
    delay_s: float = 0.0
    answers: str = "one"

    def __post_init__(self) -> None:
        require.within("read_probability", self.read_probability, low=0.0, high=1.0)
        if self.polling not in POLLINGS:
            raise ValueError(f"polling is {self.polling!r}, must be one of {', '.join(POLLINGS)}")
        if self.answers not in ANSWERS:
            raise ValueError(f"answers is {self.answers!r}, must be one of {', '.join(ANSWERS)}")
        require.within("poll_s", self.poll_s, low=1e-5, high=10.0)
        require.within("read_time_s", self.read_time_s, low=0.0, high=10.0)
        require.within("delay_s", self.delay_s, low=0.0, high=10.0)

    def schedule(self, n_readers: int, dt_s: float) -> Schedule:
        """When each of `n_readers` polls, in steps of `dt_s` seconds."""
        numbers = np.arange(n_readers)
        if self.polling == "common":
            return Schedule(np.zeros(n_readers, np.int64), np.ones(n_readers), 1)
        if self.polling == "staggered":
            return Schedule(np.zeros(n_readers, np.int64), (numbers + 0.5) / n_readers, 1)
        # Whole polls per step, or whole steps per poll.
        per_step = min(max(1, math.floor(dt_s / self.poll_s + 1e-9)), n_readers)
        steps_per_poll = max(1, math.ceil(self.poll_s / dt_s - 1e-9))
        slots = numbers // per_step * steps_per_poll
        period = -(-n_readers // per_step) * steps_per_poll
        return Schedule(slots.astype(np.int64), (numbers % per_step + 0.5) / per_step, period)
