"""Things one can buy, as data files with their sources."""

from rfiddesign.catalog.antennas import Antenna, antenna, antennas

__all__ = ["Antenna", "antenna", "antennas"]
