"""One floor, laid once: maps of it differ, its tags do not."""

from dataclasses import replace

import numpy as np
import pytest

from rfiddesign.catalog import antenna
from rfiddesign.design import Design
from rfiddesign.estimators.mcl import Mcl
from rfiddesign.estimators.pmg import Pmg
from rfiddesign.floor import build_tag_map, rectangle_floor
from rfiddesign.geometry import make_layout, make_pattern
from rfiddesign.simulation.as_built import LaidFloor, LayingFaults, laid_world, lay_floor, map_in_use, runs_on_floor
from rfiddesign.simulation.monte_carlo import Job, Simulator
from rfiddesign.simulation.record import record_with, rig_of
from rfiddesign.simulation.run import key_of, true_poses
from rfiddesign.simulation.scenario import Scenario, World

FLOOR = rectangle_floor(4000.0, 3000.0, 300.0)
DESIGN = Design(make_layout("cross-8"), antenna("60x60"), make_pattern("square", tags_per_m2=36.0))
NOMINAL = np.asarray(DESIGN.pattern.lay(FLOOR.drivable), float)
SCENARIO = Scenario(FLOOR, estimator=Pmg(softness_mm=5.0, read_probability=0.98), duration_s=10.0)


def everything(floor):
    return np.arange(len(floor.nominal_mm))


def test_a_floor_is_laid_once_for_a_seed_and_scales_with_its_error():
    fine, coarse = (lay_floor(NOMINAL, LayingFaults(error, 0.1, 4), 3) for error in (5.0, 20.0))
    assert np.array_equal(fine.is_dead, coarse.is_dead)
    assert fine.swapped_pairs() == coarse.swapped_pairs()
    place = NOMINAL[np.where(fine.partner >= 0, fine.partner, everything(fine))]
    assert coarse.true_mm - place == pytest.approx(4.0 * (fine.true_mm - place), abs=1e-9)
    assert not np.array_equal(
        lay_floor(NOMINAL, LayingFaults(5.0), 4).true_mm, lay_floor(NOMINAL, LayingFaults(5.0), 3).true_mm
    )


def test_a_floor_has_the_faults_that_were_asked_for():
    floor = lay_floor(np.tile(NOMINAL, (20, 1)), LayingFaults(8.0, 0.05, 30), 1)
    assert floor.is_dead.mean() == pytest.approx(0.05, abs=0.01)
    pairs = floor.swapped_pairs()
    assert len(pairs) == 30
    assert all(floor.partner[i] == j and floor.partner[j] == i for i, j in pairs)
    own = floor.partner < 0
    assert (floor.true_mm - floor.nominal_mm)[own].std() == pytest.approx(8.0, rel=0.03)


def test_more_pairs_than_tags_are_refused():
    with pytest.raises(ValueError, match="n_swapped_pairs is 3, at most 2 pairs are among 4 tags"):
        lay_floor(NOMINAL[:4], LayingFaults(1.0, 0.0, 3), 1)


@pytest.mark.parametrize("faults", [{"error_mm": -1.0}, {"error_mm": 1.0, "dead_share": 2.0}])
def test_faults_out_of_bounds_are_refused(faults):
    with pytest.raises(ValueError, match="must be"):
        LayingFaults(**faults)


def test_a_perfect_floor_with_its_plan_is_what_the_simulator_drives_over():
    floor = lay_floor(NOMINAL, LayingFaults(0.0), 1)
    with Simulator(SCENARIO, 7, 1) as simulator:
        usual = list(simulator.runs(Job(DESIGN, run) for run in range(3)))
        mine = runs_on_floor(simulator, DESIGN, SCENARIO, map_in_use(floor, everything(floor), NOMINAL), range(3))
    assert mine == usual


def test_the_same_floor_is_read_whatever_the_map_says():
    """Reads depend on the truth alone: tags that the robot hears with the plan are those it hears with the true map."""
    floor = lay_floor(NOMINAL, LayingFaults(20.0, 0.1), 2)
    poses, key = true_poses(SCENARIO, 7, 0), key_of(7, 0)
    rig = rig_of(DESIGN, laid_world(World(installation_error_mm=9.0, dead_share=0.5)), SCENARIO.dt_s)
    rig = rig._replace(lattice=(0.0,) * 6)
    heard = []
    for places in (floor.nominal_mm, floor.true_mm):
        in_use = map_in_use(floor, floor.alive, places[floor.alive])
        recording = record_with(rig, in_use.truth, poses, SCENARIO.dt_s, key)
        heard.append(floor.alive[recording.read_tag])
        assert recording.read_tag_mm == pytest.approx(places[heard[-1]], abs=1e-2)
    assert np.array_equal(*heard)
    assert not floor.is_dead[heard[0]].any()
    # Every read tag lies in the field of an antenna, wherever its lattice would have it.
    places = poses[1:][np.repeat(np.arange(SCENARIO.n_steps), np.diff(recording.read_start))]
    antennas = DESIGN.layout.poses_mm[recording.read_antenna]
    cosine, sine = np.cos(places[:, 2]), np.sin(places[:, 2])
    x = places[:, 0] + cosine * antennas[:, 0] - sine * antennas[:, 1]
    y = places[:, 1] + sine * antennas[:, 0] + cosine * antennas[:, 1]
    distance = np.hypot(*(np.column_stack([x, y]) - floor.true_mm[heard[1]]).T)
    assert distance.max() <= DESIGN.antenna.area.radius_mm + 0.01


def test_a_better_map_makes_a_smaller_error_on_the_same_drives():
    floor = lay_floor(NOMINAL, LayingFaults(20.0), 2)
    error = {}
    with Simulator(SCENARIO, 7, 1) as simulator:
        for name, places, softness in (("plan", NOMINAL, 20.0), ("truth", floor.true_mm, 1.0)):
            scenario = replace(SCENARIO, estimator=Pmg(softness_mm=softness, read_probability=0.98))
            runs = runs_on_floor(simulator, DESIGN, scenario, map_in_use(floor, everything(floor), places), range(8))
            error[name] = np.array([run.position_mean_mm for run in runs])
    assert (error["truth"] < error["plan"]).all()


@pytest.mark.parametrize("estimator", [Mcl(n_particles=60), Pmg(softness_mm=5.0)], ids=["mcl", "pmg"])
def test_tags_that_are_not_on_the_map_are_as_good_as_none(estimator):
    """A map without the dead tags is that of a floor which never had them."""
    floor = lay_floor(NOMINAL, LayingFaults(5.0, 0.2), 2)
    alive = floor.alive
    without = LaidFloor(NOMINAL[alive], floor.true_mm[alive], np.zeros(len(alive), bool), np.full(len(alive), -1))
    scenario = replace(SCENARIO, estimator=estimator)
    with Simulator(scenario, 7, 1) as simulator:
        struck = runs_on_floor(simulator, DESIGN, scenario, map_in_use(floor, alive, NOMINAL[alive]), range(2))
        never = runs_on_floor(
            simulator, DESIGN, scenario, map_in_use(without, np.arange(len(alive)), NOMINAL[alive]), range(2)
        )
    assert struck == never


def test_a_filter_that_listens_to_silence_is_misled_by_dead_tags_on_its_map():
    floor = lay_floor(NOMINAL, LayingFaults(0.0, 0.3), 2)
    with Simulator(SCENARIO, 7, 1) as simulator:
        unaware = runs_on_floor(simulator, DESIGN, SCENARIO, map_in_use(floor, everything(floor), NOMINAL), range(4))
        aware = runs_on_floor(
            simulator, DESIGN, SCENARIO, map_in_use(floor, floor.alive, NOMINAL[floor.alive]), range(4)
        )
    assert np.mean([run.position_mean_mm for run in unaware]) > np.mean([run.position_mean_mm for run in aware])


def test_workers_do_not_matter():
    floor = lay_floor(NOMINAL, LayingFaults(10.0), 2)
    found = []
    for n_workers in (1, 2):
        with Simulator(SCENARIO, 7, n_workers) as simulator:
            found.append(
                runs_on_floor(simulator, DESIGN, SCENARIO, map_in_use(floor, everything(floor), NOMINAL), range(4))
            )
    assert found[0] == found[1]


def test_a_map_in_use_knows_truth_and_map_apart():
    floor = lay_floor(NOMINAL, LayingFaults(10.0, 0.1), 2)
    kept = np.setdiff1d(everything(floor), [3, 5])
    in_use = map_in_use(floor, kept, NOMINAL[kept])
    assert in_use.known.n_tags == len(NOMINAL) - 2
    assert in_use.truth.n_tags == np.count_nonzero(~floor.is_dead[kept])
    expected = build_tag_map(floor.true_mm[kept][~floor.is_dead[kept]])
    assert np.array_equal(np.sort(in_use.truth.installed_x), np.sort(expected.installed_x))
