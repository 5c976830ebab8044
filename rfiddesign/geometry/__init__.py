"""Geometry: poses, detection areas, reader layouts and tag patterns."""

from rfiddesign.geometry.areas import DetectionArea, Disc, Rectangle, Ring, RoundedRectangle, sphere_floor_disc
from rfiddesign.geometry.coverage import Coverage, coverage, coverage_by_heading
from rfiddesign.geometry.drive import Aliasing, HeadingDrive, aliased_headings, blind_corridors, blind_distances
from rfiddesign.geometry.ellipse_area import Ellipse
from rfiddesign.geometry.lattice import Lattice
from rfiddesign.geometry.layouts import (
    LAYOUT_KINDS,
    LAYOUTS,
    ReaderLayout,
    bar,
    cross,
    grid,
    lattice_cross,
    listed,
    make_layout,
    ring,
    single,
)
from rfiddesign.geometry.mounting import antenna_outlines, check_layout
from rfiddesign.geometry.patterns import (
    PATTERN_KINDS,
    LatticePattern,
    ListedPattern,
    RandomPattern,
    TagPattern,
    ThinnedPattern,
    displaced,
    make_pattern,
)
from rfiddesign.geometry.polygon_area import PolygonArea
from rfiddesign.geometry.probability_map import ProbabilityMap
from rfiddesign.geometry.route_coverage import coverage_along, coverage_on_way
from rfiddesign.geometry.route_patterns import (
    ON_ROUTES,
    OnRoutesPattern,
    PlacedPattern,
    PlannedPattern,
    RouteStrip,
    on_routes,
    pattern_beneath,
    tagged_mm2,
)
from rfiddesign.geometry.se2 import between, compose, inverse, to_local, transform_points, wrap_angle

__all__ = [
    "LAYOUTS",
    "LAYOUT_KINDS",
    "ON_ROUTES",
    "PATTERN_KINDS",
    "Aliasing",
    "Coverage",
    "DetectionArea",
    "Disc",
    "Ellipse",
    "HeadingDrive",
    "Lattice",
    "LatticePattern",
    "ListedPattern",
    "OnRoutesPattern",
    "PlacedPattern",
    "PlannedPattern",
    "PolygonArea",
    "ProbabilityMap",
    "RandomPattern",
    "ReaderLayout",
    "Rectangle",
    "Ring",
    "RoundedRectangle",
    "RouteStrip",
    "TagPattern",
    "ThinnedPattern",
    "aliased_headings",
    "antenna_outlines",
    "bar",
    "between",
    "blind_corridors",
    "blind_distances",
    "check_layout",
    "compose",
    "coverage",
    "coverage_along",
    "coverage_by_heading",
    "coverage_on_way",
    "cross",
    "displaced",
    "grid",
    "inverse",
    "lattice_cross",
    "listed",
    "make_layout",
    "make_pattern",
    "on_routes",
    "pattern_beneath",
    "ring",
    "single",
    "sphere_floor_disc",
    "tagged_mm2",
    "to_local",
    "transform_points",
    "wrap_angle",
]
