"""Things one can buy, as data files with their sources."""

from rfiddesign.catalog.antennas import Antenna, antenna, antennas
from rfiddesign.catalog.readers import USUAL_READER, Reader, reader, readers

__all__ = ["USUAL_READER", "Antenna", "Reader", "antenna", "antennas", "reader", "readers"]
