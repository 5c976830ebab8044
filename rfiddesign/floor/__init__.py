"""Floors: plans as polygons, ROS maps, routes on them and the tags laid on them."""

from rfiddesign.floor.bundled_paths import BundleRules
from rfiddesign.floor.bundled_routes import NetworkRules, bundled_routes
from rfiddesign.floor.map_floor import (
    FREE,
    OCCUPIED,
    UNKNOWN,
    AreaRow,
    MapThresholds,
    area_sensitivity,
    classify,
    floor_from_map,
    unknown_peak,
)
from rfiddesign.floor.plan import Floor, floor_from_polygon, rectangle_floor
from rfiddesign.floor.prepared import prepared_copy
from rfiddesign.floor.ros_map import OccupancyMap, read_ros_map
from rfiddesign.floor.route_network import RouteNetwork, length_of
from rfiddesign.floor.routes import random_route
from rfiddesign.floor.tag_map import TagMap, build_tag_map, visible_tags, write_tags_csv

__all__ = [
    "FREE",
    "OCCUPIED",
    "UNKNOWN",
    "AreaRow",
    "BundleRules",
    "Floor",
    "MapThresholds",
    "NetworkRules",
    "OccupancyMap",
    "RouteNetwork",
    "TagMap",
    "area_sensitivity",
    "build_tag_map",
    "bundled_routes",
    "classify",
    "floor_from_map",
    "floor_from_polygon",
    "length_of",
    "prepared_copy",
    "random_route",
    "read_ros_map",
    "rectangle_floor",
    "unknown_peak",
    "visible_tags",
    "write_tags_csv",
]
