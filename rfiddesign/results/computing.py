"""How long the estimators of chosen designs take: what depends on the machine and is kept apart from the answer."""

from rfiddesign.results.study_result import Record


class MeasuredTime(Record):
    """How long the estimator of a chosen design took for a step, on one thread of the machine that ran the study."""

    n_robots: int
    estimator: str
    us_per_step: float


class Computing(Record):
    """Times of all chosen designs (`computing.json`)."""

    times: list[MeasuredTime]
