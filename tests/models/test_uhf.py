"""The UHF world: chances fall with distance, fade, stop at shelves, and change over night as declared."""

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from rfiddesign.floor import rectangle_floor
from rfiddesign.floor.scene import Obstacle, Scene, SceneTags
from rfiddesign.floor.scenes import corridor, laboratory
from rfiddesign.models import _uhf_kernels as kernels
from rfiddesign.models.uhf import N_WAVES, UhfField, UhfWorld

LAB = laboratory()
FIELD = UhfField()
STILL = replace(FIELD, fading_db=0.0, tag_db=0.0, tag_day_db=0.0)


def poses_in(scene, n, seed=0):
    """Random antenna poses where the robot's centre may be."""
    rng = np.random.default_rng(seed)
    low_x, low_y, high_x, high_y = scene.floor.navigable.bounds
    xy = np.column_stack([rng.uniform(low_x, high_x, 5 * n), rng.uniform(low_y, high_y, 5 * n)])
    xy = xy[shapely.contains_xy(scene.floor.navigable, *xy.T)][:n]
    return np.column_stack([xy, rng.uniform(-np.pi, np.pi, len(xy))])


def scene_of(positions, facing=math.pi, obstacles=()):
    positions = np.atleast_2d(np.array(positions, float))
    n = len(positions)
    tags = SceneTags(positions, np.full(n, facing), np.full(n, 1_000.0))
    return Scene(rectangle_floor(20_000, 20_000, 300), tuple(obstacles), tags)


def twin(world, poses):
    """The link budget in numpy and shapely, as the module's text has it."""
    field, tags = world.field, world.scene.tags
    way = tags.positions[None] - poses[:, None, :2]
    rise = tags.heights - field.antenna_height_mm
    d = np.maximum(np.sqrt((way**2).sum(-1) + rise**2), 100.0)
    boresight = np.column_stack([np.cos(poses[:, 2]), np.sin(poses[:, 2])])
    normal = np.column_stack([np.cos(tags.facing), np.sin(tags.facing)])
    cos_a = np.einsum("ntk,nk->nt", way, boresight) / d
    cos_b = np.einsum("ntk,tk->nt", way, normal) / d
    beam = 3.0103 / (1 - math.cos(math.radians(field.beam_deg) / 2))
    margin = 20 * np.log10(field.range_mm / d) - np.minimum(beam * (1 - cos_a), field.front_to_back_db)
    margin += 10 * np.log10(np.maximum(cos_b**2, 10 ** (-field.tag_null_db / 10)))
    phase = np.column_stack([poses[:, :2], boresight]) @ world.waves.T
    features = np.stack([np.cos(phase), np.sin(phase)], axis=-1).reshape(len(poses), -1)
    margin += features @ world.fading_weights.T.astype(float) + world.tag_offsets_db
    for obstacle in world.scene.obstacles:
        loss = {"wall": field.wall_db, "shelf": field.shelf_db}[obstacle.material]
        for i, pose in enumerate(poses):
            ends = np.broadcast_to(pose[:2], tags.positions.shape)
            rays = shapely.linestrings(np.stack([ends, tags.positions], axis=1))
            margin[i] -= loss * shapely.intersects(obstacle.outline, rays)
    chance = field.most_probability / (1 + np.exp(-margin / field.softness_db))
    return np.where(d < field.most_range_mm, chance, 0.0)


@pytest.mark.parametrize("scene", [LAB, corridor()], ids=["laboratory", "corridor"])
def test_compiled_chances_equal_the_link_budget_in_numpy_and_shapely(scene):
    world = UhfWorld(scene, FIELD, seed=3, day=2)
    poses = poses_in(scene, 60)
    chance = world.read_probability(poses)
    assert chance.dtype == np.float32
    assert chance.shape == (len(poses), scene.n_tags)
    assert np.abs(chance - twin(world, poses)).max() < 1e-4
    assert (chance > 0.3).sum() > 100


@given(
    st.lists(st.tuples(*[st.integers(-50, 50)] * 2), min_size=3, max_size=8, unique=True),
    st.tuples(*[st.floats(-60, 60)] * 4),
)
@settings(max_examples=200)
def test_blocking_counts_what_shapely_says_is_crossed(corners, way):
    outline = shapely.MultiPoint(corners).convex_hull
    if outline.geom_type != "Polygon":
        return
    ray = shapely.LineString([way[:2], way[2:]])
    # Where they only just touch, rounding may decide.
    if (
        abs(outline.boundary.distance(shapely.Point(way[:2]))) < 1e-6
        or outline.exterior.distance(shapely.Point(way[2:])) < 1e-6
    ):
        return
    inner, outer = outline.buffer(-1e-6), outline.buffer(1e-6)
    if inner.intersects(ray) != outer.intersects(ray):
        return
    points = shapely.get_coordinates(outline.exterior)
    edges = np.column_stack([points[:-1], points[1:]])
    lost = kernels.blocking_db(*way, edges, np.array([0, len(edges)]), np.array([outline.bounds]), np.array([7.0]))
    is_inside = outline.contains(ray)  # both ends inside: no edge is crossed
    assert lost == (7.0 if outline.intersects(ray) and not is_inside else 0.0)


def test_losses_of_obstacles_add_up():
    walls = [Obstacle(shapely.box(x, -500, x + 100, 500), "wall") for x in (500, 1_000)]
    world = UhfWorld(scene_of([2_000, 0], obstacles=walls), replace(STILL, wall_db=5.0))
    bare = UhfWorld(scene_of([2_000, 0]), STILL)
    odds = [p / (FIELD.most_probability - p) for p in (w.read_probability([[0, 0, 0]])[0, 0] for w in (world, bare))]
    assert math.log(odds[1] / odds[0]) * FIELD.softness_db == pytest.approx(10.0, abs=1e-2)


@given(st.integers(0, 2**40), st.integers(0, 2**40))
@settings(max_examples=10, deadline=None)
def test_chances_are_chances(seed, day):
    chance = UhfWorld(LAB, FIELD, seed, day).read_probability(poses_in(LAB, 20, seed))
    assert chance.min() >= 0
    assert chance.max() <= FIELD.most_probability


def test_chance_falls_with_distance_and_ends_at_the_greatest_range():
    far = np.arange(500.0, 9_000.0, 250.0)
    scene = scene_of(np.column_stack([far, np.zeros_like(far)]))
    still = UhfWorld(scene, STILL).read_probability([[0, 0, 0]])[0]
    in_range = far < FIELD.most_range_mm
    assert (np.diff(still[in_range]) < 0).all()
    assert (still[~in_range] == 0).all()
    # Half of what is possible at the range.
    assert still[far == FIELD.range_mm] == pytest.approx(FIELD.most_probability / 2, abs=1e-4)
    # Fading makes single tags better and worse, but on average the chance falls all the same.
    worlds = [UhfWorld(scene, FIELD, seed).read_probability([[0, 0, 0]])[0] for seed in range(300)]
    mean = np.mean(worlds, axis=0)
    assert (
        mean[far <= 1_000].mean() > mean[(far > 2_500) & (far < 3_500)].mean() > mean[(far > 5_500) & in_range].mean()
    )


def test_antenna_and_tag_hear_best_along_their_axes():
    scene = scene_of([2_000, 0])
    turned = UhfWorld(scene, replace(STILL, range_mm=2_500)).read_probability([[0, 0, a] for a in (0, 0.4, 0.8, 1.2)])
    assert (np.diff(turned[:, 0]) < 0).all()
    seen_from = [[2_000 - 2_000 * math.cos(a), 2_000 * math.sin(a), -a] for a in (0, 0.5, 1.0, 1.5)]
    around = UhfWorld(scene, replace(STILL, range_mm=2_500)).read_probability(seen_from)
    assert (np.diff(around[:, 0]) < 0).all()


def test_nothing_is_read_through_the_metal_shelf():
    poses, is_buried = poses_in(LAB, 300), LAB.is_buried()
    chance = UhfWorld(LAB, FIELD, 5, 1).read_probability(poses)
    assert chance[:, is_buried].max() == 0
    (shelf,) = (o.outline for o in LAB.obstacles if o.material == "shelf")
    north = ~is_buried & (LAB.tags.positions[:, 1] > 4_100) & (LAB.tags.positions[:, 1] < 4_120)
    from_south = (poses[:, 1] < 2_600) & (np.abs(poses[:, 0] - 5_000) < 900)
    assert shelf.area > 0
    assert from_south.sum() > 10
    assert chance[from_south][:, north].max() < 1e-3
    facing_it = np.array([[5_000.0, 5_200.0, -math.pi / 2]])
    assert UhfWorld(LAB, FIELD, 5, 1).read_probability(facing_it)[:, north].sum() > 10


def test_a_world_is_its_seed_and_day():
    poses = poses_in(LAB, 50)
    chance = UhfWorld(LAB, FIELD, 7, 3).read_probability(poses)
    assert np.array_equal(chance, UhfWorld(LAB, FIELD, 7, 3).read_probability(poses))
    # Poses are read one by one, whatever their order.
    assert np.array_equal(chance[::-1], UhfWorld(LAB, FIELD, 7, 3).read_probability(poses[::-1]))
    assert not np.array_equal(chance, UhfWorld(LAB, FIELD, 7, 4).read_probability(poses))
    assert not np.array_equal(chance, UhfWorld(LAB, FIELD, 8, 3).read_probability(poses))


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
def test_fading_of_two_days_correlates_as_declared(share):
    field = replace(FIELD, day_share=share)
    one, other = (UhfWorld(LAB, field, 11, day).fading_weights.ravel().astype(float) for day in (1, 2))
    # 62,720 weights: the correlation is known to 1 / sqrt(n) = 0.004.
    assert np.corrcoef(one, other)[0, 1] == pytest.approx(1 - share, abs=0.02)
    for weights in (one, other):
        assert weights.std() * math.sqrt(N_WAVES) == pytest.approx(FIELD.fading_db, rel=0.02)


def test_fading_has_the_declared_deviation_and_correlation_lengths():
    chords = FIELD.fading_chord
    same = np.zeros((1, 3))
    moved, turned = np.array([[FIELD.fading_mm, 0, 0]]), np.array([[0, 0, 2 * math.asin(chords / 2)]])
    products = {"same": [], "moved": [], "turned": []}
    for seed in range(40):
        world = UhfWorld(LAB, FIELD, seed)
        values = []
        for poses in (same, moved, turned):
            vector = np.column_stack([poses[:, :2], np.cos(poses[:, 2]), np.sin(poses[:, 2])])
            phase = vector @ world.waves.T
            features = np.stack([np.cos(phase), np.sin(phase)], -1).reshape(1, -1)
            values.append(features @ world.fading_weights.T.astype(float))
        for name, value in zip(products, values, strict=True):
            products[name].append(np.mean(values[0] * value))
    variance = FIELD.fading_db**2
    assert np.mean(products["same"]) == pytest.approx(variance, rel=0.03)
    assert np.mean(products["moved"]) == pytest.approx(variance * math.exp(-0.5), rel=0.08)
    assert np.mean(products["turned"]) == pytest.approx(variance * math.exp(-0.5), rel=0.08)


def test_bad_values_are_refused_by_name():
    with pytest.raises(ValueError, match="day_share"):
        UhfField(day_share=1.5)
    with pytest.raises(ValueError, match="softness_db is 0"):
        UhfField(softness_db=0.0)
    with pytest.raises(ValueError, match="day"):
        UhfWorld(LAB, FIELD, 1, -1)
    with pytest.raises(ValueError, match=r"shape \(3,\)"):
        UhfWorld(LAB).read_probability(np.zeros(3))
    with pytest.raises(ValueError, match="finite"):
        UhfWorld(LAB).read_probability([[0, math.nan, 0]])
