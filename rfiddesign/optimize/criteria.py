"""What a design is held against over its runs: a share that must be kept, or a mean that must stay low.

Each run gives a score per criterion in [0, 1].  For a share it is 1 where the run kept the limits and 0 where not; for
a mean it is what was measured over the most that counts.  A quantile is a share: "the 90 % quantile of the error over
all drives is at most L" says the same as "at least 90 % of drives keep the error at or below L".

Two thresholds with an indifference zone between them make each criterion testable: a design *holds* beyond one of them,
and is *certified* once it is proved beyond the other.
"""

from dataclasses import dataclass

from rfiddesign import require

# Evidence is rounded to doubles some thousands of times; asking for a millionth more of it than needed outweighs that
# (relative error below 1e-7 at 100,000 runs), so that no verdict ever rests on a rounding in the wrong direction.
ROUNDING_MARGIN = 1e-6


@dataclass(frozen=True)
class ShareCriterion:
    """A share of runs.

    Parameters
    ----------
    name : what is asked, in words.
    hold : p0, a design holds if at least this share of its runs scores 1.
    fail : p1 < p0, a certified design scores 1 in more than this share.

    Raises
    ------
    ValueError : unless 0 < fail < hold < 1.
    """

    name: str
    hold: float
    fail: float

    def __post_init__(self) -> None:
        require.within("hold", self.hold, low=0.0, high=1.0, is_low_open=True)
        if not 0 < self.fail < self.hold < 1:
            raise ValueError(f"fail must lie in (0, hold = {self.hold:g}) and hold below 1, found {self.fail:g}")


@dataclass(frozen=True)
class MeanCriterion:
    """A mean of scores, such as errors, of which less is better.

    Parameters
    ----------
    name : what is asked, in words.
    hold : m0, a design holds if its mean score is at most this.
    fail : m1 > m0, a certified design has a mean score below this.

    Raises
    ------
    ValueError : unless 0 < hold < fail < 1.
    """

    name: str
    hold: float
    fail: float

    def __post_init__(self) -> None:
        require.within("hold", self.hold, low=0.0, high=1.0, is_low_open=True)
        if not 0 < self.hold < self.fail < 1:
            raise ValueError(f"fail must lie in (hold = {self.hold:g}, 1), found {self.fail:g}")


Criterion = ShareCriterion | MeanCriterion
