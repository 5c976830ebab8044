"""Detection fields that are larger or smaller in truth than in the catalogue, which the filter believes."""

import numpy as np
import pytest
import shapely

from rfiddesign.catalog import Antenna, antenna
from rfiddesign.design import Design
from rfiddesign.estimators.mcl import Mcl
from rfiddesign.estimators.particle_filter import ParticleFilter
from rfiddesign.evaluate import evaluate
from rfiddesign.floor import build_tag_map, rectangle_floor
from rfiddesign.geometry import (
    Disc,
    Ellipse,
    ListedPattern,
    ProbabilityMap,
    Rectangle,
    Ring,
    RoundedRectangle,
    compose,
    listed,
    make_layout,
    make_pattern,
    to_local,
)
from rfiddesign.models.motion import OmnidirectionalMotion
from rfiddesign.models.read_field import read_field
from rfiddesign.models.reads import ReadModel
from rfiddesign.simulation.record import record, rig_of
from rfiddesign.simulation.run import key_of, prepare
from rfiddesign.simulation.scenario import Scenario, World

DT = 0.05
QUIET = OmnidirectionalMotion(0.0, 0.0, 0.0)
YAWED = listed([(150.0, 0.0, 0.0), (-100.0, 200.0, 0.7), (0.0, -180.0, -2.2), (-210.0, -30.0, 1.5)])
FACTORS = [0.5, 0.9, 1.1, 2.0]
CHANCES = np.array([[0.9, 0.1, 0.0], [0.6, 1.0, 0.4]])
# An antenna's area and radii of RSSI at a size.
SIZED = {
    "disc": lambda size: (Disc(40.0 * size), ()),
    "rectangle": lambda size: (Rectangle(120.0 * size, 70.0 * size), ()),
    "rounded": lambda size: (RoundedRectangle(110.0 * size, 60.0 * size, 20.0 * size), ()),
    "probabilities": lambda size: (ProbabilityMap(CHANCES, 40.0 * size), ()),
    "rssi": lambda size: (Disc(80.0 * size), (80.0 * size, 60.0 * size, 35.0 * size)),
}


def a_design(area, radii=(), pattern=None):
    return Design(YAWED, Antenna("test", (1.0, 1.0), area, "test", radii), pattern or ListedPattern(np.zeros((1, 2))))


def random_drive(seed, n_steps=400):
    rng = np.random.Generator(np.random.PCG64(seed))
    steps = np.cumsum(rng.normal(0, [20, 20, 0.1], (n_steps, 3)), axis=0)
    return np.array([1500.0, 1500.0, 1.0]) + np.concatenate([np.zeros((1, 3)), steps])


def assert_same_reads(found, expected):
    assert found.n_reads > 40
    for part in ("read_start", "read_antenna", "read_tag", "read_age_s", "read_rssi"):
        assert np.array_equal(getattr(found, part), getattr(expected, part))


@pytest.mark.parametrize("factor", FACTORS)
@pytest.mark.parametrize("kind", SIZED)
@pytest.mark.parametrize(
    ("reads", "sigma"),
    [
        (ReadModel(), 0.0),
        (ReadModel(0.9, "staggered"), 5.0),
        (ReadModel(0.9, "multiplexed", 0.02, 0.04, 0.03, "all"), 5.0),
    ],
)
def test_a_scaled_field_reads_as_an_antenna_of_that_size_read_for_read(kind, factor, reads, sigma):
    """Listed tags and the lattice that is asked first alike."""
    pattern, poses = make_pattern("triangular", pitch_mm=90.0), random_drive(3)
    tags = build_tag_map(pattern.lay(shapely.box(0, 0, 3000, 3000)))
    for shortcut in (None, pattern):
        found, expected = (
            record(
                a_design(*SIZED[kind](size), shortcut), tags, poses, DT,
                World(QUIET, reads, sigma, field_scale=field_scale), key_of(2, 1),
            )
            for size, field_scale in ((1.0, factor), (factor, 1.0))
        )  # fmt: skip
        assert_same_reads(found, expected)


@pytest.mark.parametrize("factor", FACTORS)
@pytest.mark.parametrize(
    ("area", "scaled"),
    [
        (Ellipse(90.0, 40.0), lambda size: Ellipse(90.0 * size, 40.0 * size)),
        (Ring(30.0, 70.0), lambda size: Ring(30.0 * size, 70.0 * size)),
    ],
    ids=["ellipse", "ring"],
)
def test_a_tabulated_field_is_that_of_the_scaled_area_to_a_cell_of_its_table(area, scaled, factor):
    tags = np.random.Generator(np.random.PCG64(5)).uniform(0, 3000, (1500, 2)).astype(np.float32).astype(float)
    poses, true_area = random_drive(4), scaled(factor)
    recording = record(a_design(area), build_tag_map(tags), poses, DT, World(QUIET, field_scale=factor), key_of(3, 1))
    doubt = factor * read_field(area).cell_mm
    for t in range(400):
        rows = range(recording.read_start[t], recording.read_start[t + 1])
        tag_read_by = {int(recording.read_antenna[row]): int(recording.read_tag[row]) for row in rows}
        for a in range(4):
            distance = true_area.signed_distance(to_local(compose(poses[t + 1], YAWED.poses_mm[a]), tags))
            if a in tag_read_by:
                assert distance[tag_read_by[a]] <= doubt
            else:
                assert not (distance < -doubt).any()
    assert recording.n_reads > 50


@pytest.mark.parametrize("kind", SIZED)
def test_a_field_of_the_catalogue_s_size_is_the_catalogue_s_to_the_last_bit(kind):
    area, radii = SIZED[kind](1.0)
    for found, expected in zip(rig_of(a_design(area, radii), World(), DT).field, read_field(area, radii), strict=True):
        assert np.array_equal(found, expected)


def test_scaling_leaves_the_field_that_other_worlds_share_alone():
    design = a_design(*SIZED["rssi"](1.0))
    rig_of(design, World(field_scale=0.5), DT)
    assert rig_of(design, World(), DT).field.rssi_radii.tolist() == [80.0, 60.0, 35.0]


@pytest.mark.parametrize("settings", [Mcl(), ParticleFilter()], ids=["mcl", "particle_filter"])
def test_the_filter_believes_the_catalogue(settings):
    design = Design(make_layout("cross-8"), antenna("60x60"), make_pattern("square", tags_per_m2=60.0))
    floor = rectangle_floor(4000.0, 3000.0, 300.0)
    true, off = (
        prepare(design, Scenario(floor, world=World(field_scale=scale, dead_share=share), estimator=settings))
        for scale, share in ((1.0, 0.0), (0.8, 0.2))
    )
    assert true.robot == off.robot
    assert true.rig.field.corner_mm * 0.8 == off.rig.field.corner_mm
    for found, expected in zip(off.ready.model, true.ready.model, strict=True):
        assert repr(found) == repr(expected)


def test_a_field_that_the_filter_does_not_know_makes_errors_larger():
    design = Design(make_layout("cross-8"), antenna("60x60"), make_pattern("square", tags_per_m2=60.0))
    floor = rectangle_floor(4000.0, 3000.0, 300.0)
    errors = {
        scale: evaluate(
            design,
            Scenario(floor, world=World(field_scale=scale), estimator=ParticleFilter(), duration_s=20.0), 4, seed=5,
        ).metrics()["position_mean_mm"].mean
        for scale in (0.6, 1.0, 1.6)
    }  # fmt: skip
    assert errors[0.6] > 1.5 * errors[1.0]
    assert errors[1.6] > 1.5 * errors[1.0]
