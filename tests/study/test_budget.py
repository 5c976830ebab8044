"""A budget is shared out fairly, and what one search leaves is for the next."""

import pytest

from rfiddesign.study.budget import Budget


def test_runs_are_shared_among_what_is_left():
    budget = Budget(900, None)
    assert budget.runs_for_one_of(3) == 300
    budget.spend(100)
    assert budget.runs_for_one_of(2) == 400
    budget.spend(1000)
    assert budget.runs_for_one_of(1) == 0
    assert Budget(None, None).runs_for_one_of(3) is None


def test_time_is_shared_from_the_moment_a_search_begins():
    now = [100.0]
    budget = Budget(None, 1.0, clock=lambda: now[0])
    first = budget.time_for_one_of(2)
    assert first() == 0.0
    now[0] += 15.0
    assert first() == pytest.approx(0.5)
    now[0] += 5.0
    second = budget.time_for_one_of(1)  # 40 s of the minute are left
    now[0] += 40.0
    assert second() == pytest.approx(1.0)
    assert budget.time_for_one_of(1)() == 1.0
    assert Budget(5, None).time_for_one_of(1) is None
