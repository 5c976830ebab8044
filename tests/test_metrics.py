"""What is measured on a run and when it passes; golden numbers by hand."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rfiddesign.metrics import (
    LIMITED_METRICS,
    Requirement,
    convergence_time,
    has_certainly_failed,
    is_localized,
    percentile,
    summarize,
)

DT = 0.5
# Ten steps of half a second: lost for three, localized for two, lost once more, localized to the end.
POSITION = np.array([90.0, 80.0, 60.0, 20.0, 10.0, 70.0, 5.0, 4.0, 3.0, 8.0])
HEADING = np.array([0.5, 0.1, 0.1, 0.1, 0.2, 0.0, 0.0, 0.1, 0.0, 0.3])


def a_run(**changes):
    return replace(summarize(np.ones(20), np.full(20, 0.01), 0.05, 0), **changes)


# Metrics


def test_metrics_of_a_run_by_hand():
    run = summarize(POSITION, HEADING, DT, 0)
    assert run.position_mean_mm == pytest.approx(35.0)
    assert run.position_rms_mm == pytest.approx(math.sqrt(23_614 / 10))
    assert run.position_p95_mm == 90.0
    assert run.position_max_mm == 90.0
    assert run.heading_mean_rad == pytest.approx(0.14)
    assert run.heading_rms_rad == pytest.approx(math.sqrt(0.42 / 10))
    assert run.heading_p95_rad == 0.5
    assert run.heading_max_rad == 0.5
    # Inside both bounds at steps 3, 4 and 6 to 8; two steps are a second; step 3, the fourth, ends after 2 s.
    assert run.lost_share == pytest.approx(0.5)
    assert run.convergence_s == pytest.approx(2.0)
    assert (run.n_steps, run.is_complete) == (10, True)


def test_errors_count_from_the_settling_time_on_but_convergence_from_the_start():
    run = summarize(POSITION, HEADING, DT, 6)
    assert run.position_mean_mm == pytest.approx(5.0)
    assert run.position_max_mm == 8.0
    assert run.heading_max_rad == 0.3
    assert run.lost_share == pytest.approx(0.25)
    assert run.convergence_s == pytest.approx(2.0)
    assert run.n_steps == 10


def test_a_run_stopped_before_it_counts_is_measured_over_what_there_is():
    run = summarize(POSITION[:4], HEADING[:4], DT, 6, is_complete=False)
    assert run.position_mean_mm == pytest.approx(62.5)
    assert not run.is_complete


@pytest.mark.parametrize(("n", "rank"), [(1, 1), (2, 2), (19, 19), (20, 19), (21, 20), (40, 38), (100, 95), (101, 96)])
def test_percentile_is_the_least_error_that_95_percent_do_not_exceed(n, rank):
    assert percentile(np.random.Generator(np.random.PCG64(n)).permutation(n) + 1.0) == rank


def test_percentile_rank_does_not_suffer_from_rounding():
    for n in range(1, 3000):
        rank = -(-95 * n // 100)
        assert percentile(np.arange(1.0, n + 1)) == rank


@pytest.mark.parametrize(
    ("position", "heading", "expected"),
    [
        ([0, 0, 0, 0], [0, 0, 0, 0], 0.5),
        ([50, 50, 99, 99], [0.2, 0.2, 9, 9], 0.5),
        ([50.01, 50, 50, 99], [0, 0, 0, 0], 1.0),
        ([0, 0, 0, 0], [0.21, 0, 0.21, 0], math.inf),
        ([99, 99, 0, 0], [0, 0, 0, 0], 1.5),
        ([99, 99, 99, 0], [0, 0, 0, 0], math.inf),
        ([0], [0], math.inf),
    ],
)
def test_convergence_is_the_first_whole_second_within_the_bounds(position, heading, expected):
    """50 mm and 0.2 rad, at half-second steps."""
    assert convergence_time(np.array(position, float), np.array(heading, float), DT) == expected


def test_convergence_with_steps_longer_than_a_second_takes_one_step():
    assert convergence_time(np.array([99.0, 0.0]), np.zeros(2), 3.0) == 6.0


@settings(max_examples=200, deadline=None, derandomize=True)
@given(inside=st.lists(st.booleans(), max_size=80), dt=st.sampled_from([0.05, 0.1, 0.3, 0.7, 1.0, 2.0]))
def test_convergence_is_that_of_a_plain_search(inside, dt):
    position = np.where(inside, 10.0, 100.0)
    hold = max(1, round(1 / dt))
    starts = [i for i in range(len(inside) - hold + 1) if all(inside[i : i + hold])]
    expected = (starts[0] + 1) * dt if starts else math.inf
    assert convergence_time(position, np.zeros(len(inside)), dt) == pytest.approx(expected)


def test_both_bounds_count_for_being_localized():
    assert is_localized(np.array([50.0, 50.1, 1.0]), np.array([0.2, 0.0, 0.3])).tolist() == [True, False, False]


@settings(max_examples=200, deadline=None, derandomize=True)
@given(seed=st.integers(0, 2**32 - 1), n=st.integers(1, 300), first_scored=st.integers(0, 310))
def test_a_summary_is_that_of_numpy(seed, n, first_scored):
    position, heading = np.random.Generator(np.random.PCG64(seed)).gamma(2.0, (30.0, 0.1), (n, 2)).T.copy()
    run = summarize(position, heading, 0.05, first_scored)
    start = first_scored if n > first_scored else 0
    for name, errors in (("position_{}_mm", position[start:]), ("heading_{}_rad", heading[start:])):
        assert getattr(run, name.format("mean")) == pytest.approx(errors.mean(), rel=1e-12)
        assert getattr(run, name.format("rms")) == pytest.approx(np.sqrt(np.mean(errors**2)), rel=1e-12)
        assert getattr(run, name.format("max")) == errors.max()
        assert getattr(run, name.format("p95")) == np.quantile(errors, 0.95, method="inverted_cdf")
    assert run.lost_share == np.mean(~is_localized(position[start:], heading[start:]))


# Requirements


def test_a_run_at_its_limit_passes_and_one_beyond_fails():
    for metric in LIMITED_METRICS:
        requirement = Requirement(((metric, 7.0),))
        assert requirement.is_met(a_run(**{metric: 7.0}))
        assert not requirement.is_met(a_run(**{metric: 7.0001}))


def test_every_limit_must_hold():
    requirement = Requirement((("position_mean_mm", 5.0), ("heading_max_rad", 0.1)), converged_within_s=3.0)
    assert requirement.is_met(a_run())
    for change in ({"position_mean_mm": 6.0}, {"heading_max_rad": 0.2}, {"convergence_s": 3.1}, {"is_complete": False}):
        assert not requirement.is_met(a_run(**change))


def test_a_run_that_never_converged_is_not_in_time():
    assert not Requirement((), converged_within_s=1e6).is_met(a_run(convergence_s=math.inf))


def test_scaling_moves_limits_on_errors_and_not_the_time_to_converge():
    requirement = Requirement((("position_mean_mm", 5.0), ("lost_share", 0.1)), converged_within_s=3.0)
    assert requirement.scaled(2.0) == Requirement((("position_mean_mm", 10.0), ("lost_share", 0.2)), 3.0)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Requirement(()), ("requirement", "at least one")),
        (lambda: Requirement((("speed", 1.0),)), ("'speed'", "position_mean_mm", "lost_share")),
        (lambda: Requirement((("convergence_s", 1.0),)), ("'convergence_s'", "position_mean_mm")),
        (lambda: Requirement((("position_mean_mm", 0.0),)), ("position_mean_mm", "0.0", "above 0")),
        (lambda: Requirement((("position_mean_mm", math.nan),)), ("position_mean_mm", "nan")),
        (lambda: Requirement((), converged_within_s=-1.0), ("converged_within_s", "-1.0", "above 0")),
        (lambda: Requirement((("lost_share", 0.1),)).scaled(0.0), ("lost_share", "0.0", "above 0")),
    ],
)
def test_a_bad_requirement_is_named_with_its_value_and_bound(make, words):
    with pytest.raises(ValueError, match=words[0]) as error:
        make()
    assert all(word in str(error.value) for word in words)
    assert "\n" not in str(error.value)


# Certain failure


errors_of_a_run = st.integers(1, 60).flatmap(
    lambda n: st.tuples(
        st.lists(st.one_of(st.sampled_from([0.0, 0.1, 10.0, 50.0, 50.1]), st.floats(0, 200)), min_size=n, max_size=n),
        st.lists(st.one_of(st.sampled_from([0.0, 0.2]), st.floats(0, 3.2)), min_size=n, max_size=n),
    )
)


@settings(max_examples=500, deadline=None, derandomize=True)
@given(
    errors=errors_of_a_run,
    metric=st.sampled_from(LIMITED_METRICS),
    slack=st.sampled_from([0.5, 0.99, 1.0, 1.0 + 1e-12, 1.01, 2.0]),
    within=st.one_of(st.none(), st.floats(0.05, 10)),
    dt=st.sampled_from([0.05, 0.3, 1.0]),
    settle_share=st.floats(0, 0.99),
)
def test_a_run_that_would_pass_is_never_called_certainly_failed(errors, metric, slack, within, dt, settle_share):
    """Limits at and about what the whole run measures, where rounding decides."""
    position, heading = (np.array(part) for part in errors)
    n = position.size
    first_scored = int(settle_share * n)
    whole = summarize(position, heading, dt, first_scored)
    limit = getattr(whole, metric) * slack
    requirement = Requirement(((metric, limit),) if limit > 0 else (("position_max_mm", 1e3),), within)
    has_failed = [
        has_certainly_failed(requirement, position[:done], heading[:done], dt, first_scored, n)
        for done in range(1, n + 1)
    ]
    if requirement.is_met(whole):
        assert not any(has_failed)
    # What is certain stays certain.
    assert has_failed == sorted(has_failed)


def failed_by_numpy(requirement, position, heading, n_scored):
    """The rules of `has_certainly_failed` for limits, in numpy; all steps are scored."""
    for metric, limit in requirement.limits:
        errors = heading if metric.startswith("heading") else position
        is_lost = {
            "share": np.mean(~is_localized(position, heading)) * position.size / n_scored > limit,
            "max": errors.max() > limit,
            "p95": np.count_nonzero(errors > limit) > n_scored - math.ceil(0.95 * n_scored),
            "rms": np.sum(errors**2) > limit**2 * n_scored * (1 + 1e-9),
            "mean": errors.sum() > limit * n_scored * (1 + 1e-9),
        }
        if is_lost[metric.split("_")[1]]:
            return True
    return False


@settings(max_examples=200, deadline=None, derandomize=True)
@given(
    seed=st.integers(0, 2**32 - 1),
    n=st.integers(1, 100),
    metrics=st.lists(st.sampled_from(LIMITED_METRICS), min_size=1),
)
def test_certain_failure_is_that_of_numpy(seed, n, metrics):
    rng = np.random.Generator(np.random.PCG64(seed))
    position, heading = rng.gamma(2.0, (30.0, 0.1), (n, 2)).T.copy()
    whole = summarize(position, heading, 0.05, 0)
    requirement = Requirement(tuple((name, (getattr(whole, name) + 1e-3) * rng.uniform(0.3, 1.2)) for name in metrics))
    for done in range(1, n + 1):
        so_far = position[:done], heading[:done]
        expected = failed_by_numpy(requirement, *so_far, n)
        assert has_certainly_failed(requirement, *so_far, 0.05, 0, n) == expected


@pytest.mark.parametrize(
    ("requirement", "at_step"),
    [
        (Requirement((("position_max_mm", 50.0),)), 1),
        (Requirement((("position_p95_mm", 50.0),)), 6),
        (Requirement((("position_mean_mm", 10.0),)), 11),
        (Requirement((("position_rms_mm", 50.0),)), 26),
        (Requirement((("lost_share", 0.25),)), 26),
        (Requirement((), converged_within_s=1.0), 41),
    ],
)
def test_failure_is_called_as_soon_as_it_is_certain(requirement, at_step):
    """100 steps that are 100 mm off all along; for convergence the call may come a step late."""
    position = np.full(100, 100.0)
    called = [has_certainly_failed(requirement, position[:n], np.zeros(n), 0.05, 0, 100) for n in range(1, 101)]
    assert at_step <= called.index(True) + 1 <= at_step + 1


def test_a_share_of_lost_steps_just_at_its_limit_is_not_lost():
    """29 of 100 steps at a limit of 0.29, whose product with 100 rounds below 29."""
    position = np.where(np.arange(100) < 29, 100.0, 1.0)
    requirement = Requirement((("lost_share", 0.29),))
    assert requirement.is_met(summarize(position, np.zeros(100), 0.05, 0))
    assert not has_certainly_failed(requirement, position[:50], np.zeros(50), 0.05, 0, 100)


def test_a_run_that_converges_at_the_last_moment_is_not_called_failed_before_its_second_is_over():
    """Lost after each of 19 steps of 50 ms, localized from the 20th on: it converged after 1.0 s, as known at 2.0 s."""
    position = np.where(np.arange(100) < 19, 100.0, 1.0)
    requirement = Requirement((), converged_within_s=1.0)
    assert requirement.is_met(summarize(position, np.zeros(100), 0.05, 0))
    for n in range(1, 101):
        assert not has_certainly_failed(requirement, position[:n], np.zeros(n), 0.05, 0, 100)
