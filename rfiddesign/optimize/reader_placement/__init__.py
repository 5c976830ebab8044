"""Where to mount readers on a robot so that reads come within a distance from every phase of the tags and heading."""

from rfiddesign.optimize.reader_placement.bounds import fewest_readers
from rfiddesign.optimize.reader_placement.exact import SolverLimits
from rfiddesign.optimize.reader_placement.place import Placement, place_readers
from rfiddesign.optimize.reader_placement.problem import MOTIONS, PlacementProblem
from rfiddesign.optimize.reader_placement.recheck import MotionCheck, is_guaranteed, recheck
from rfiddesign.optimize.reader_placement.rivals import Rival, rivals
from rfiddesign.optimize.reader_placement.search import PlacementLimits
from rfiddesign.optimize.reader_placement.sparse_pattern import Drive, SparsePattern, sparsest_patterns

__all__ = [
    "MOTIONS",
    "Drive",
    "MotionCheck",
    "Placement",
    "PlacementLimits",
    "PlacementProblem",
    "Rival",
    "SolverLimits",
    "SparsePattern",
    "fewest_readers",
    "is_guaranteed",
    "place_readers",
    "recheck",
    "rivals",
    "sparsest_patterns",
]
