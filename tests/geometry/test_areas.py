"""Every kind of detection area, in areas.py, ellipse_area.py, polygon_area.py and probability_map.py."""

import math
import re

import numpy as np
import pytest
import shapely
from hypothesis import example, given
from hypothesis import strategies as st

from rfiddesign.geometry import (
    DetectionArea,
    Disc,
    Ellipse,
    PolygonArea,
    ProbabilityMap,
    Rectangle,
    Ring,
    RoundedRectangle,
    sphere_floor_disc,
)

L_SHAPE = ((-20.0, -30.0), (40.0, -30.0), (40.0, 0.0), (0.0, 0.0), (0.0, 50.0), (-20.0, 50.0))
TWO_LOBES = np.array([[0.9, 0.8, 0.1, 0.9], [0.6, 0.4, 0.5, 0.7], [0.2, 0.1, 0.0, 0.51]])
AREAS = [
    Disc(30.0),
    Rectangle(320.0, 230.0),
    RoundedRectangle(320.0, 230.0, 60.0),
    RoundedRectangle(60.0, 60.0, 30.0),
    Ellipse(70.0, 24.5),
    Ellipse(10.0, 95.0),
    Ring(20.0, 45.0),
    PolygonArea(L_SHAPE),
    ProbabilityMap(TWO_LOBES, 12.0),
]
every_area = pytest.mark.parametrize("area", AREAS, ids=lambda area: type(area).__name__)
sizes = st.floats(1.0, 500.0)


def cloud(area, n=2000):
    """Points in and around an area, on its axes, and at its centre."""
    spread = np.random.Generator(np.random.PCG64(7)).uniform(-1.5, 1.5, size=(n, 2)) * area.reach_mm
    on_axes = np.linspace(-1.5, 1.5, 31)[:, None] * area.reach_mm * np.array([1.0, 0.0])
    return np.concatenate([spread, on_axes, on_axes[:, ::-1]])


@every_area
def test_every_area_keeps_the_protocol(area):
    assert isinstance(area, DetectionArea)


@every_area
def test_an_area_agrees_with_its_outline(area):
    outline = area.outline()
    assert outline.is_valid
    assert area.area_mm2 == pytest.approx(outline.area, rel=2e-4)
    distance_from_centre = np.hypot(*shapely.get_coordinates(outline).T)
    assert area.reach_mm == pytest.approx(distance_from_centre.max(), rel=1e-4)
    points = cloud(area)
    is_clear = np.abs(area.signed_distance(points)) > 1e-4 * area.reach_mm
    np.testing.assert_array_equal(area.contains(points)[is_clear], shapely.contains_xy(outline, points)[is_clear])


@every_area
def test_the_signed_distance_is_the_distance_to_the_border_and_negative_inside(area):
    points = cloud(area)
    outline = area.outline()
    expected = shapely.distance(outline.boundary, shapely.points(points))
    expected = np.where(shapely.contains_xy(outline, points), -expected, expected)
    np.testing.assert_allclose(area.signed_distance(points), expected, rtol=0, atol=1e-4 * area.reach_mm)


@every_area
def test_mean_and_covariance_are_those_of_a_uniform_tag(area):
    # A fine grid of midpoints over the area: an independent, if rough, integral.
    step = area.reach_mm / 400
    axis = np.arange(-400.5, 401) * step
    grid = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
    tags = grid[area.contains(grid)]
    np.testing.assert_allclose(area.centroid_mm, tags.mean(axis=0), rtol=0, atol=2e-3 * area.reach_mm)
    expected = np.cov(tags, rowvar=False, bias=True)
    np.testing.assert_allclose(area.covariance_mm2, expected, rtol=0, atol=2e-3 * area.reach_mm**2)


@every_area
def test_points_of_any_shape_are_taken(area):
    points = cloud(area, n=24)[:24].reshape(2, 3, 4, 2)
    assert area.contains(points).shape == (2, 3, 4)
    assert area.signed_distance(points).shape == (2, 3, 4)
    assert area.signed_distance(points[1, 2, 3]) == area.signed_distance(points)[1, 2, 3]
    assert area.contains(np.empty((0, 2))).shape == (0,)


@given(sizes, sizes, st.floats(0, 1))
def test_a_rounded_rectangle_turns_from_rectangle_to_disc(length, width, share):
    rounded = RoundedRectangle(length, width, share * min(length, width) / 2)
    polygon = PolygonArea(tuple(map(tuple, shapely.get_coordinates(rounded.outline())[:-1])))
    np.testing.assert_allclose(rounded.covariance_mm2, polygon.covariance_mm2, rtol=0, atol=2e-4 * rounded.reach_mm**2)
    sharp, round_ = RoundedRectangle(length, width, 0.0), RoundedRectangle(length, length, length / 2)
    np.testing.assert_allclose(sharp.covariance_mm2, Rectangle(length, width).covariance_mm2, rtol=1e-12)
    np.testing.assert_allclose(round_.covariance_mm2, Disc(length / 2).covariance_mm2, rtol=1e-9, atol=1e-9 * length**2)
    assert round_.area_mm2 == pytest.approx(Disc(length / 2).area_mm2, rel=1e-12)


@given(sizes, sizes, sizes, st.floats(-3, 3))
def test_the_moments_of_a_turned_rectangle_as_a_polygon_are_exact(length, width, shift, angle):
    rotation = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    corners = shapely.get_coordinates(Rectangle(length, width).outline())[:-1] @ rotation.T + shift
    polygon = PolygonArea(tuple(map(tuple, corners)))
    expected = rotation @ Rectangle(length, width).covariance_mm2 @ rotation.T
    np.testing.assert_allclose(polygon.covariance_mm2, expected, rtol=0, atol=1e-9 * max(length, width, shift) ** 2)
    np.testing.assert_allclose(polygon.centroid_mm, (shift, shift), rtol=1e-9)


@example(semi_x=90.0, semi_y=1.0, angle=1 / 64, step=0.0)
@given(sizes, sizes, st.floats(-math.pi, math.pi), st.floats(-1, 1))
def test_a_step_along_the_normal_of_an_ellipse_is_its_signed_distance(semi_x, semi_y, angle, step):
    # Inward this holds up to the smallest radius of curvature, b^2 / a.
    step *= 0.99 * min(semi_x, semi_y) ** 2 / max(semi_x, semi_y)
    border = np.array([semi_x * math.cos(angle), semi_y * math.sin(angle)])
    normal = np.array([math.cos(angle) / semi_x, math.sin(angle) / semi_y])
    point = border + step * normal / np.hypot(*normal)
    assert Ellipse(semi_x, semi_y).signed_distance(point) == pytest.approx(step, abs=1e-7)


@pytest.mark.parametrize(("semi_x", "semi_y"), [(70.0, 24.5), (3.0, 300.0), (50.0, 50.0), (50.0, 49.999999)])
def test_deep_inside_an_ellipse_the_distance_is_exact_to_1e_6_mm(semi_x, semi_y):
    inside = np.random.Generator(np.random.PCG64(3)).uniform(-0.7, 0.7, size=(200, 2)) * (semi_x, semi_y)
    special = np.array([[0, 0], [semi_x / 2, 0], [0, semi_y / 2], [1e-9, 1e-9], [-semi_x, 0], [0, semi_y]])
    points = np.concatenate([inside, special])
    angle = np.linspace(0, 2 * math.pi, 100_001)
    border = shapely.LineString(np.stack([semi_x * np.cos(angle), semi_y * np.sin(angle)], axis=-1))
    shapely.prepare(border)
    expected = shapely.distance(border, shapely.points(points))
    np.testing.assert_allclose(np.abs(Ellipse(semi_x, semi_y).signed_distance(points)), expected, rtol=0, atol=1e-6)


def test_the_sphere_of_equation_5_cuts_the_floor_in_a_disc():
    # findings 1: R = 15, h_a = 20, h_c = 8 give 9 mm; R = 30, h_a = h_c = 24 give 30 mm.
    assert sphere_floor_disc(15, 20, 8).radius_mm == pytest.approx(9)
    assert sphere_floor_disc(30, 24, 24).radius_mm == pytest.approx(30)
    # ... and 3 mm of height error move the small disc to 12 mm, or to nothing, the large one by 0.15 mm.
    assert sphere_floor_disc(15, 17, 8).radius_mm == pytest.approx(12)
    assert sphere_floor_disc(15, 20, 8, tag_height=3).radius_mm == pytest.approx(12)
    assert sphere_floor_disc(30, 27, 24).radius_mm == pytest.approx(29.85, abs=0.005)
    with pytest.raises(ValueError, match=r"radius = 15: must exceed 15 mm"):
        sphere_floor_disc(15, 23, 8)


def test_a_probability_map_has_its_first_row_lowest_and_ends_at_its_border():
    area = ProbabilityMap([[0.9, 0.1], [0.2, 0.7]], 10.0)
    np.testing.assert_array_equal(
        area.probability_at([(-5, -5), (5, -5), (-5, 5), (5, 5), (10.1, 5), (-11, 0)]), [0.9, 0.1, 0.2, 0.7, 0, 0]
    )
    np.testing.assert_array_equal(area.contains([(-5, -5), (5, -5), (5, 5), (-5, 5)]), [True, False, True, False])
    assert area.area_mm2 == 200


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: Disc(-1.0), "radius_mm = -1.0: must be a finite number above 0"),
        (lambda: Disc(math.nan), "radius_mm = nan: must be"),
        (lambda: Disc("30"), "radius_mm = '30': must be"),
        (lambda: Rectangle(10.0, 0.0), "width_mm = 0.0: must be"),
        (lambda: RoundedRectangle(60.0, 40.0, 21.0), "corner_mm = 21: must be at most 20"),
        (lambda: Ellipse(10.0, math.inf), "semi_y_mm = inf: must be"),
        (lambda: Ring(20.0, 20.0), "outer_mm = 20.0: must be above inner_mm = 20"),
        (lambda: PolygonArea(((0, 0), (1, 1))), "vertices_mm of shape"),
        (lambda: PolygonArea(((0, 0), (1, 1), (1, 0), (0, 1))), "vertices_mm: must be a simple polygon"),
        (lambda: ProbabilityMap([[0.5]], 1.0), "probability: must exceed 1/2"),
        (lambda: ProbabilityMap([[1.5]], 1.0), "probability of shape"),
    ],
)
def test_impossible_areas_are_refused(build, message):
    with pytest.raises(ValueError, match=f"^{re.escape(message)}"):
        build()
