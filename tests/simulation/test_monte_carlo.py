"""Runs on many threads are the runs of one."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import pytest
import shapely

from rfiddesign.catalog import antenna
from rfiddesign.design import Design
from rfiddesign.estimators.ekf import Ekf
from rfiddesign.floor import rectangle_floor
from rfiddesign.geometry import make_layout, make_pattern
from rfiddesign.simulation.installed import InstalledTags
from rfiddesign.simulation.monte_carlo import MAX_SEED, Job, Simulator
from rfiddesign.simulation.scenario import Scenario

FLOOR = rectangle_floor(4000.0, 4000.0, 300.0)
SCENARIO = Scenario(FLOOR, start="unknown", duration_s=5.0)


def a_design(tags_per_m2=100.0, layout="cross-8"):
    return Design(make_layout(layout), antenna("60x60"), make_pattern("square", tags_per_m2=tags_per_m2))


BAR = {"kind": "bar", "n": 4, "spacing_mm": 110.0}
DESIGNS = [a_design(density, layout) for density in (100.0, 25.0) for layout in ("cross-8", BAR)]
JOBS = [Job(design, run) for run in range(6) for design in DESIGNS]


def metrics_of(jobs, seed=11, n_workers=1):
    with Simulator(SCENARIO, seed, n_workers) as simulator:
        return dict(zip(jobs, simulator.runs(jobs), strict=True))


def test_runs_are_the_same_on_any_number_of_workers_in_any_order_and_company():
    alone = metrics_of(JOBS)
    # Two designs that read nothing in a run err alike.
    assert len(set(alone.values())) > len(JOBS) - 3
    for n_workers in (2, 4):
        assert metrics_of(JOBS, n_workers=n_workers) == alone
    assert metrics_of(JOBS[::-1], n_workers=2) == alone
    for job in JOBS[3:12:4]:
        assert metrics_of([job]) == {job: alone[job]}


def test_a_submitted_run_is_the_run_and_a_trace_tells_its_course():
    with Simulator(SCENARIO, 11, 2) as simulator:
        futures = [simulator.submit(job) for job in JOBS]
        expected = metrics_of(JOBS)
        assert [future.result() for future in futures] == [expected[job] for job in JOBS]
        trace = simulator.trace(JOBS[0])
    assert trace.position_error_mm.mean() == pytest.approx(expected[JOBS[0]].position_mean_mm, rel=1e-12)
    assert trace.true_poses.shape == trace.poses.shape == (101, 3)


def test_designs_meet_the_same_route_in_a_run():
    with Simulator(SCENARIO, 11, 1) as simulator:
        first, second = (simulator.trace(Job(design, 4)) for design in (a_design(), a_design(9.0, BAR)))
        other = simulator.trace(Job(a_design(), 5))
    assert (first.true_poses == second.true_poses).all()
    assert (first.true_poses != other.true_poses).any()


def test_a_job_s_estimator_takes_the_place_of_the_scenario_s():
    """A design meets each estimator in the runs that it would meet were that the scenario's own."""
    design, ekf = DESIGNS[0], Ekf(kind="constrained")
    named = Simulator(replace(SCENARIO, estimator=ekf), 11, 1)
    with Simulator(SCENARIO, 11, 2) as simulator, named:
        pairs = [Job(design, run, estimator) for run in range(4) for estimator in (None, ekf, SCENARIO.estimator)]
        found = list(simulator.runs(pairs))
        of_ekf = list(named.runs(Job(design, run) for run in range(4)))
    own = [metrics_of([Job(design, run)])[Job(design, run)] for run in range(4)]
    assert found[0::3] == found[2::3] == own
    assert found[1::3] == of_ekf
    assert set(own).isdisjoint(of_ekf)


def test_another_seed_is_another_study():
    assert not set(metrics_of(JOBS, seed=12).values()) & set(metrics_of(JOBS).values())


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"seed": -1}, ("seed", "-1", "0")),
        ({"seed": MAX_SEED + 1}, ("seed", str(MAX_SEED + 1), str(MAX_SEED))),
        ({"seed": 0, "n_workers": 0}, ("n_workers", "0", "1")),
    ],
)
def test_a_bad_argument_is_named_with_its_value_and_bound(arguments, words):
    with pytest.raises(ValueError, match=words[0]) as error:
        Simulator(SCENARIO, **arguments)
    assert all(word in str(error.value) for word in words)


def test_the_largest_seed_works():
    assert len(metrics_of(JOBS[:1], seed=MAX_SEED)) == 1


# Tags


def test_tags_of_a_pattern_are_laid_once_and_shared_by_threads():
    installed, pattern = InstalledTags(FLOOR), make_pattern("square", pitch_mm=20.0)
    with ThreadPoolExecutor(8) as pool:
        maps = list(pool.map(lambda _: installed.lay(pattern), range(32)))
    assert all(tags is maps[0] for tags in maps)
    assert maps[0].n_tags == len(pattern.lay(FLOOR.drivable))


def test_tags_used_least_recently_are_forgotten_when_there_are_too_many():
    patterns = [make_pattern("square", pitch_mm=pitch) for pitch in (100.0, 90.0, 80.0)]
    sizes = [len(pattern.lay(FLOOR.drivable)) for pattern in patterns]
    installed = InstalledTags(FLOOR, max_tags=sizes[0] + sizes[2])
    first, second = (installed.lay(pattern) for pattern in patterns[:2])
    assert installed.lay(patterns[0]) is first
    installed.lay(patterns[2])
    assert installed.lay(patterns[0]) is first
    assert installed.lay(patterns[1]) is not second


def test_a_pattern_larger_than_what_is_kept_still_works():
    installed = InstalledTags(FLOOR, max_tags=1)
    assert installed.lay(make_pattern("square", pitch_mm=100.0)).n_tags > 1


def test_tags_lie_on_the_drivable_floor():
    with Simulator(SCENARIO, 0, 1) as simulator:
        tags = simulator.tags(make_pattern("triangular", tags_per_m2=30.0))
        assert list(
            simulator.map(
                lambda pattern: simulator.tags(pattern).n_tags, [make_pattern("triangular", tags_per_m2=30.0)]
            )
        ) == [tags.n_tags]
    assert shapely.intersects_xy(FLOOR.drivable.buffer(0.01), tags.nominal_x, tags.nominal_y).all()
    assert tags.n_tags == pytest.approx(30 * FLOOR.area_m2, rel=0.05)
