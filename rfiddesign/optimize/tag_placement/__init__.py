"""Placement of tags along the routes that robots drive."""

from rfiddesign.optimize.tag_placement.choose import choose_tags
from rfiddesign.optimize.tag_placement.drive_check import DriveCheck
from rfiddesign.optimize.tag_placement.placement import TagPlacement, place_tags
from rfiddesign.optimize.tag_placement.rules import PlacementRules

__all__ = ["DriveCheck", "PlacementRules", "TagPlacement", "choose_tags", "place_tags"]
