"""Scenes hold what the paper tells of its rooms, and tags are where waves and robots meet them."""

import math

import numpy as np
import pytest
import shapely

from rfiddesign.floor.scene import Obstacle, Scene, SceneTags, joined, tags_on_line
from rfiddesign.floor.scenes import B21_RADIUS_MM, corridor, laboratory, warehouse

SCENES = {
    "laboratory": laboratory(),
    "lower": corridor("lower"),
    "higher": corridor("higher"),
    "warehouse": warehouse(20_000.0, 14_000.0),
}
every_scene = pytest.mark.parametrize("scene", SCENES.values(), ids=SCENES)


def in_lab(scene):
    return shapely.contains_xy(shapely.box(0, 0, 10_000, 7_000), *scene.tags.positions.T)


def test_laboratory_has_the_papers_area_shelf_and_numbers_of_tags():
    scene = SCENES["laboratory"]
    assert scene.floor.area_m2 == pytest.approx(50.0, abs=1e-6)
    (shelf,) = (o.outline for o in scene.obstacles if o.material == "shelf")
    assert sorted(np.ptp(np.array(shelf.bounds).reshape(2, 2), axis=0)) == [1_200.0, 2_000.0]
    at_shelf = shapely.dwithin(shelf, shapely.points(scene.tags.positions), 11.0)
    assert at_shelf.sum() == 400
    assert scene.n_tags - scene.is_buried().sum() == 374
    # Passages at the shelf: the floor's centre line is half as far from both sides as the passage is wide.
    gaps = [shelf.distance(edge) for edge in (shapely.box(0, 0, 2_800, 4_110), shapely.box(3_200, 0, 6_800, 1_100))]
    assert gaps == pytest.approx([1_200.0, 1_800.0])


@pytest.mark.parametrize(("density", "n_tags"), [("lower", 141), ("higher", 209)])
def test_corridor_has_the_papers_area_and_a_hundred_tags_in_the_laboratory(density, n_tags):
    scene = SCENES[density]
    assert scene.floor.area_m2 == pytest.approx(75.0, abs=1e-6)
    assert scene.n_tags == n_tags
    assert in_lab(scene).sum() == 100
    low_x, low_y, high_x, high_y = scene.floor.drivable.bounds
    assert min(high_x - low_x, high_y - low_y) >= 2_200.0


def test_walls_of_the_laboratory_carry_four_tags_per_metre():
    positions = SCENES["laboratory"].tags.positions
    for is_on_wall, length_m in (
        (positions[:, 0] < 20, 7.0),
        (positions[:, 0] > 9_980, 7.0),
        (positions[:, 1] > 6_980, 8.5),
    ):
        assert is_on_wall.sum() == round(4 * length_m)


@every_scene
def test_the_robots_centre_keeps_its_radius_from_what_stands_on_the_floor(scene):
    radius = 300.0 if scene.name == "warehouse" else B21_RADIUS_MM
    assert scene.floor.drivable.contains(scene.floor.navigable)
    for obstacle in scene.obstacles:
        # Arcs of the navigable area are exact to 0.13 % of the radius, see `floor_from_polygon`.
        assert obstacle.outline.distance(scene.floor.navigable) >= radius * (1 - 0.0013)
        assert not obstacle.outline.contains(scene.floor.navigable)


@every_scene
def test_tags_that_are_not_buried_look_at_open_space(scene):
    tags, is_buried = scene.tags, scene.is_buried()
    solid = shapely.union_all([obstacle.outline for obstacle in scene.obstacles])
    ahead = tags.positions + 50 * np.column_stack([np.cos(tags.facing), np.sin(tags.facing)])
    behind = tags.positions - 50 * np.column_stack([np.cos(tags.facing), np.sin(tags.facing)])
    assert not shapely.contains_xy(solid, *tags.positions[~is_buried].T).any()
    assert not shapely.contains_xy(solid, *ahead[~is_buried].T).any()
    assert shapely.contains_xy(solid, *behind[~is_buried].T).all()


@pytest.mark.parametrize("density", [1.0, 4.0, 7.5])
def test_warehouse_has_aisles_of_at_least_the_width_asked_for_and_the_density_of_tags(density):
    scene = warehouse(30_000.0, 16_000.0, aisle_mm=2_200.0, shelf_depth_mm=1_000.0, tags_per_m=density)
    shelves = [obstacle.outline for obstacle in scene.obstacles]
    walls = shapely.box(0, 0, 30_000, 16_000).exterior
    for i, shelf in enumerate(shelves):
        assert shelf.distance(walls) >= 2_200.0 - 1e-6
        assert all(shelf.distance(other) >= 2_200.0 - 1e-6 for other in shelves[i + 1 :])
    # One more row would not fit.
    assert (len(shelves) + 1) * 3_200.0 + 2_200.0 > 16_000.0
    front_m = 2 * len(shelves) * 25.6
    assert scene.n_tags == pytest.approx(density * front_m, abs=len(shelves))
    assert scene.floor.area_m2 == pytest.approx(30 * 16 - len(shelves) * 25.6, abs=1e-6)


def test_tags_on_a_line_are_evenly_spaced_and_face_left():
    tags = tags_on_line((0, 0), (0, 1_000), 4, (500.0, 1_500.0))
    assert len(tags) == 8
    assert np.allclose(tags.positions[:4], [[-10, 125], [-10, 375], [-10, 625], [-10, 875]])
    assert np.allclose(np.cos(tags.facing), -1)
    assert tags.heights.tolist() == [500.0] * 4 + [1_500.0] * 4


def test_bad_scenes_are_refused_by_name():
    with pytest.raises(ValueError, match="density is 'low'"):
        corridor("low")
    with pytest.raises(ValueError, match="material is 'water'"):
        Obstacle(shapely.box(0, 0, 1, 1), "water")
    with pytest.raises(ValueError, match="holes"):
        Obstacle(shapely.box(0, 0, 9, 9).difference(shapely.box(3, 3, 6, 6)), "wall")
    with pytest.raises(ValueError, match="shapes"):
        SceneTags(np.zeros((3, 2)), np.zeros(2), np.zeros(3))
    with pytest.raises(ValueError, match="finite"):
        SceneTags(np.zeros((1, 2)), np.array([math.nan]), np.zeros(1))
    with pytest.raises(ValueError, match="no row of shelves fits"):
        warehouse(3_000.0, 14_000.0)
    with pytest.raises(ValueError, match="allowed are 100,000"):
        warehouse(30_000.0, 14_000.0, tags_per_m=1e5)


def test_a_scene_keeps_its_tags_as_they_are():
    scene = SCENES["laboratory"]
    with pytest.raises(ValueError, match="read-only"):
        scene.tags.positions[0, 0] = 1.0
    both = joined([scene.tags, scene.tags.chosen(np.arange(3))])
    assert len(Scene(scene.floor, (), both).tags) == scene.n_tags + 3
