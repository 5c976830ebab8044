"""Antennas by name: how large they are and what they see of the floor."""

import tomllib
from dataclasses import dataclass
from functools import cache
from importlib import resources

from shapely.geometry import Polygon, box

from rfiddesign.geometry import DetectionArea, Rectangle, sphere_floor_disc


@dataclass(frozen=True)
class Antenna:
    """An antenna one can buy.

    Parameters
    ----------
    name : as studies and price lists call it.
    housing_mm : length (x) and width (y) of the housing.
    area : what it sees of the floor, in its own frame.
    source : where these numbers come from, or "assumption: ...".
    """

    name: str
    housing_mm: tuple[float, float]
    area: DetectionArea
    source: str

    def outline(self) -> Polygon:
        """The housing seen from above, centred [mm]."""
        length, width = self.housing_mm
        return box(-length / 2, -width / 2, length / 2, width / 2)


@cache
def antennas() -> dict[str, Antenna]:
    """Every antenna of the catalog by name."""
    text = resources.files("rfiddesign.catalog").joinpath("antennas.toml").read_text(encoding="utf-8")
    return {name: _antenna(name, entry) for name, entry in tomllib.loads(text).items()}


def antenna(name: str) -> Antenna:
    """The antenna of that name; ValueError lists the names there are."""
    known = antennas()
    if name not in known:
        raise ValueError(f"antenna is {name!r}, must be one of {', '.join(known)}")
    return known[name]


def _antenna(name: str, entry: dict) -> Antenna:
    if "sphere" in entry:
        sphere = entry["sphere"]
        area = sphere_floor_disc(sphere["radius_mm"], sphere["antenna_height_mm"], sphere["centre_depth_mm"])
    else:
        area = Rectangle(*entry["rectangle_mm"])
    length, width = entry["housing_mm"]
    return Antenna(name, (length, width), area, entry["source"])
