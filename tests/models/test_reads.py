"""When and how surely readers poll."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rfiddesign.models.reads import ReadModel

DT = 0.05


def polls(reads, n, dt_s=DT, n_periods=3):
    """Antennas and times [steps] of all polls over some periods of the schedule, in order of time."""
    schedule = reads.schedule(n, dt_s)
    assert schedule.slots.shape == schedule.phases.shape == (n,)
    steps = np.arange(n_periods * schedule.period)
    step, antenna = np.nonzero(steps[:, None] % schedule.period == schedule.slots)
    times = step + schedule.phases[antenna]
    order = np.argsort(times, kind="stable")
    return antenna[order], times[order], schedule.period


def test_common_polling_is_at_the_end_of_every_step():
    antenna, times, period = polls(ReadModel(), 8)
    assert period == 1
    assert np.array_equal(times, np.repeat([1.0, 2.0, 3.0], 8))
    assert np.array_equal(antenna, np.tile(np.arange(8), 3))


@pytest.mark.parametrize("n", [1, 2, 8, 96])
def test_staggered_polls_are_evenly_spread_over_every_step(n):
    """The first and the last as far from the step's ends as half the time between two polls."""
    antenna, times, period = polls(ReadModel(polling="staggered"), n)
    assert period == 1
    assert np.array_equal(antenna, np.tile(np.arange(n), 3))
    assert np.diff(times) == pytest.approx(np.full(3 * n - 1, 1 / n))
    assert times[0] == pytest.approx(0.5 / n)


@given(polling=st.sampled_from(["common", "staggered", "multiplexed"]), n=st.integers(1, 96),
       poll_s=st.floats(1e-3, 1.0), dt_s=st.floats(5e-3, 0.5))  # fmt: skip
def test_each_antenna_polls_once_per_period_in_turn(polling, n, poll_s, dt_s):
    antenna, times, period = polls(ReadModel(polling=polling, poll_s=poll_s), n, dt_s)
    assert np.array_equal(antenna, np.tile(np.arange(n), 3))
    assert ((times > 0) & (times <= 3 * period)).all()
    for a in range(n):
        assert np.diff(times[antenna == a]) == pytest.approx(np.full(2, period))


@pytest.mark.parametrize(
    ("poll_s", "n", "period", "gap"),
    [
        # Below dt: five polls per step, two steps for eight antennas.
        (0.01, 10, 2, 1 / 5), (0.025, 8, 4, 1 / 2),
        # All within one step: as staggered.
        (0.005, 10, 1, 1 / 10), (0.001, 8, 1, 1 / 8),
        # Equal to dt, and above: whole steps per poll.
        (0.05, 8, 8, 1.0), (0.1, 4, 8, 2.0), (0.12, 3, 9, 3.0), (0.03, 4, 4, 1.0),
    ],
)  # fmt: skip
def test_multiplexed_antennas_take_turns_evenly(poll_s, n, period, gap):
    """Never faster than `poll_s`; slower only to fill whole steps."""
    _, times, found = polls(ReadModel(polling="multiplexed", poll_s=poll_s), n)
    assert found == period
    assert np.diff(times) == pytest.approx(np.full(3 * n - 1, gap))
    assert gap * DT >= poll_s - 1e-12


@given(n=st.integers(1, 96), poll_s=st.floats(1e-3, 1.0), dt_s=st.floats(5e-3, 0.5))
def test_a_multiplexer_is_never_faster_than_its_polls(n, poll_s, dt_s):
    """And loses less than one poll per step, or one step per poll, and the rest of a period's last step."""
    _, times, period = polls(ReadModel(polling="multiplexed", poll_s=poll_s), n, dt_s)
    if n > 1:
        assert np.diff(times).min() * dt_s >= poll_s * (1 - 1e-6)
    per_step = max(1, math.floor(dt_s / poll_s + 1e-9))
    assert period <= math.ceil(n / per_step) * math.ceil(poll_s / dt_s)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"read_probability": 1.1}, "read_probability is 1.1, must be at least 0 and at most 1"),
        ({"read_probability": float("nan")}, "read_probability is nan"),
        ({"polling": "sometimes"}, "polling is 'sometimes', must be one of common, staggered, multiplexed"),
        ({"answers": "some"}, "answers is 'some', must be one of one, all"),
        ({"poll_s": 0.0}, "poll_s is 0.0, must be at least 1e-05"),
        ({"poll_s": float("nan")}, "poll_s is nan"),
        ({"read_time_s": -0.1}, "read_time_s is -0.1, must be at least 0"),
        ({"delay_s": 11.0}, "delay_s is 11.0, must be at least 0 and at most 10"),
    ],
)
def test_a_bad_argument_is_named_with_its_value_and_bound(arguments, message):
    with pytest.raises(ValueError, match=message):
        ReadModel(**arguments)
