"""Polygons with an index, for many questions at a time."""

import shapely
from shapely.geometry.base import BaseGeometry


def prepared_copy(geometry: BaseGeometry) -> BaseGeometry:
    """Return a copy of a geometry that is indexed for questions such as `shapely.contains_xy`.

    GEOS builds an index at the first question of each kind and does not guard it: threads that share a prepared
    geometry crash.  So whoever asks prepares a copy and shares it with nobody.
    """
    copy = shapely.from_wkb(shapely.to_wkb(geometry))
    shapely.prepare(copy)
    return copy
