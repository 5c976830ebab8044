"""A world of UHF tags: how likely an antenna at a pose reads each, by a link budget with fading and obstacles.

The margin of a tag [dB], from distance d, the angle a between boresight and tag, the angle b between the tag's normal
and the antenna:

    20 log10(range / d) - min(beam (1 - cos a), front_to_back) + 10 log10(max(cos^2 b, null))
        + fading(tag, antenna's pose, day) + offset(tag, day) - losses of the obstacles between

Passive tags fall silent where the wave no longer feeds them, hence the one-way law.  A label is a dipole along its
surface: it hears as well from behind, if nothing is there.  The fading is what reflections add up to, a Gaussian field
over the antenna's x, y and boresight, for each tag its own; every day a share of its variance is new.  The chance to be
read in one cycle is a logistic function of the margin.
"""

import math
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import shapely
from numpy.typing import NDArray

from rfiddesign import require
from rfiddesign.floor.scene import Scene
from rfiddesign.models import _uhf_kernels as kernels
from rfiddesign.numerics._lane_kernels import LANES
from rfiddesign.numerics._noise_kernels import fill_normal, run_key, step_key

#: Where a B21 carries its two antenna pairs: within its hull, their boresights 90 degrees apart.
PAIRS_OF_B21 = ((170.0, 170.0, math.pi / 4), (170.0, -170.0, -math.pi / 4))
#: Waves that a fading field is the sum of; its correlation is that of the Gaussian field to about 1 / sqrt(2 n).
N_WAVES = 64

# Streams of the world's draws: apart from all that runs draw.
_STREAM_WAVES, _STREAM_FADING, _STREAM_FADING_OF_DAY, _STREAM_OFFSET, _STREAM_OFFSET_OF_DAY = range(32, 37)


@dataclass(frozen=True)
class UhfField:
    """How UHF antennas read, apart from where tags and obstacles are.

    The defaults are plausible; studies/uhf-snapshots has the set that fits the paper.

    Parameters
    ----------
    range_mm : distance at which a tag, faced along the boresight, is at the threshold without fading [mm].
    most_range_mm : no tag is read from farther away [mm].
    beam_deg : full angle between the half-power directions of an antenna [deg].
    front_to_back_db : what the antenna's pattern takes at most [dB].
    tag_null_db : what a tag's pattern takes at most, seen along its surface [dB].
    fading_db : standard deviation of the fading [dB].
    fading_mm : way of the antenna over which the fading's correlation falls to exp(-1/2) [mm].
    fading_chord : the same for the boresight's turn, as the chord on the unit circle (about the angle [rad]).
    day_share : share of the fading's variance that is new every day; two days correlate by 1 - day_share.
    tag_db, tag_day_db : standard deviation of how much better or worse a tag hears than others, for good and on a day
        [dB].
    softness_db : how gradually the chance falls about the threshold: one more e-fold of the odds takes so much [dB].
    most_probability : chance to read a tag in one cycle with margin in plenty; others answer at the same time.
    wall_db, shelf_db : loss through a wall and a shelf [dB].
    antenna_height_mm : height of the antennas above the floor [mm].
    """

    range_mm: float = 5_000.0
    most_range_mm: float = 7_000.0
    beam_deg: float = 70.0
    front_to_back_db: float = 20.0
    tag_null_db: float = 20.0
    fading_db: float = 4.0
    fading_mm: float = 250.0
    fading_chord: float = 0.5
    day_share: float = 0.3
    tag_db: float = 3.0
    tag_day_db: float = 1.0
    softness_db: float = 1.5
    most_probability: float = 0.9
    wall_db: float = 6.0
    shelf_db: float = 60.0
    antenna_height_mm: float = 1_000.0

    def __post_init__(self) -> None:
        for name in ("range_mm", "most_range_mm", "fading_mm", "antenna_height_mm"):
            require.within(name, getattr(self, name), low=1.0, high=1e5)
        require.within("beam_deg", self.beam_deg, low=1.0, high=360.0)
        require.within("fading_chord", self.fading_chord, low=1e-3, high=1e6)
        for name in ("front_to_back_db", "tag_null_db", "fading_db", "tag_db", "tag_day_db"):
            require.within(name, getattr(self, name), low=0.0, high=60.0)
        for name in ("wall_db", "shelf_db"):
            require.within(name, getattr(self, name), low=0.0, high=200.0)
        for name in ("day_share", "most_probability"):
            require.within(name, getattr(self, name), low=0.0, high=1.0)
        require.within("softness_db", self.softness_db, low=0.01, high=20.0)

    @property
    def beam_loss_db(self) -> float:
        """Loss per 1 - cos of the angle off the boresight [dB]: 3 dB at half of `beam_deg`."""
        return 10 * math.log10(2.0) / (1.0 - math.cos(math.radians(self.beam_deg / 2)))

    @property
    def compiled(self) -> tuple[np.float32, ...]:
        """The law for compiled code, see `_uhf_kernels.read_probability`."""
        law = (
            20 * math.log10(self.range_mm), self.most_range_mm**2, self.beam_loss_db, self.front_to_back_db,
            10 ** (-self.tag_null_db / 10), self.fading_db, self.softness_db, self.most_probability,
        )  # fmt: skip
        return tuple(np.float32(value) for value in law)


@dataclass(frozen=True, eq=False)
class UhfWorld:
    """The read probabilities of a scene on one day; a `DetectionField`.

    Parameters
    ----------
    scene : tags and obstacles.
    field : how antennas read.
    seed : number of the world.
    day : number of the day; days of one world share all but what changes over night.
    """

    scene: Scene
    field: UhfField = field(default_factory=UhfField)
    seed: int = 0
    day: int = 0

    def __post_init__(self) -> None:
        require.seed("seed", self.seed)
        require.seed("day", self.day)

    @property
    def n_tags(self) -> int:
        """How many tags the scene has."""
        return self.scene.n_tags

    def read_probability(self, antenna_poses: NDArray[np.float64]) -> NDArray[np.float32]:
        """Chance (n, n_tags) that an antenna at each pose (n, 3) (x, y [mm], boresight [rad]) reads each tag in one
        cycle; 0 where it is below 6e-6.

        Raises
        ------
        ValueError : if the poses are not finite or not (n, 3).
        """
        poses = np.ascontiguousarray(antenna_poses, np.float64)
        if poses.ndim != 2 or poses.shape[1] != 3:
            raise ValueError(f"antenna_poses has shape {poses.shape}, must be (n, 3)")
        if not (np.abs(poses) < 1e7).all():
            raise ValueError("antenna_poses: must be finite and below 1e7")
        out = np.zeros((len(poses), self.n_tags), np.float32)
        height = np.float32(self.field.antenna_height_mm)
        kernels.read_probability(
            poses, height, self._tags, (self.waves, self._weights.ravel()), self.field.compiled, self._obstacles, out
        )
        return out

    @cached_property
    def waves(self) -> NDArray[np.float64]:
        """Frequencies (N_WAVES, 4) over x, y [1/mm] and the boresight's cosine and sine that fading is made of."""
        # The key's second half is the day, so that what all days share is drawn for day 0.
        of_seed = self._normals(_STREAM_WAVES, 0, N_WAVES * 4).reshape(N_WAVES, 4).astype(float)
        lengths = np.array([self.field.fading_mm] * 2 + [self.field.fading_chord] * 2)
        return of_seed / lengths

    @cached_property
    def fading_weights(self) -> NDArray[np.float32]:
        """Weights (n_tags, 2 N_WAVES) of the waves' cosines and sines, in turn, for each tag [dB]."""
        field, shape = self.field, (self.n_tags, 2 * N_WAVES)
        n = shape[0] * shape[1]
        lasting, of_day = self._normals(_STREAM_FADING, 0, n), self._normals(_STREAM_FADING_OF_DAY, self.day, n)
        scale = field.fading_db / math.sqrt(N_WAVES)
        mixed = math.sqrt(1.0 - field.day_share) * lasting + math.sqrt(field.day_share) * of_day
        return (scale * mixed).astype(np.float32).reshape(shape)

    @cached_property
    def tag_offsets_db(self) -> NDArray[np.float32]:
        """How much better each tag (n_tags,) hears than others today [dB]."""
        lasting = self._normals(_STREAM_OFFSET, 0, self.n_tags)
        of_day = self._normals(_STREAM_OFFSET_OF_DAY, self.day, self.n_tags)
        return (self.field.tag_db * lasting + self.field.tag_day_db * of_day).astype(np.float32)

    def _normals(self, stream: int, day: int, n: int) -> NDArray[np.float32]:
        drawn = np.empty(n, np.float32)
        fill_normal(np.uint64(step_key(np.uint64(run_key(self.seed, day)), stream, 0)), drawn)
        return drawn

    @cached_property
    def _weights(self) -> NDArray[np.float32]:
        """The weights in blocks of LANES tags, (n_blocks, 2 N_WAVES, LANES)."""
        blocks = _in_lanes(self.fading_weights)
        return np.ascontiguousarray(blocks.reshape(-1, LANES, 2 * N_WAVES).transpose(0, 2, 1))

    @cached_property
    def _tags(self) -> tuple[NDArray[np.float32], ...]:
        tags = self.scene.tags
        columns = (*tags.positions.T, np.cos(tags.facing), np.sin(tags.facing), tags.heights, self.tag_offsets_db)
        return tuple(_in_lanes(np.asarray(column, np.float32)) for column in columns)

    @cached_property
    def _obstacles(self) -> tuple[NDArray, ...]:
        """Edges, where those of each obstacle begin, boxes and losses, see `_uhf_kernels.blocking_db`."""
        loss_of = {"wall": self.field.wall_db, "shelf": self.field.shelf_db}
        edges, start, bounds, loss = [np.zeros((0, 4))], [0], [], []
        for obstacle in self.scene.obstacles:
            points = shapely.get_coordinates(obstacle.outline.exterior)
            edges.append(np.column_stack([points[:-1], points[1:]]))
            start.append(start[-1] + len(points) - 1)
            bounds.append(obstacle.outline.bounds)
            loss.append(loss_of[obstacle.material])
        return (
            np.concatenate(edges), np.array(start, np.int64), np.array(bounds, float).reshape(-1, 4),
            np.array(loss, float),
        )  # fmt: skip


def _in_lanes(rows: NDArray[np.float32]) -> NDArray[np.float32]:
    """Rows filled up with zeros to whole groups of LANES."""
    n_more = -len(rows) % LANES
    return np.concatenate([rows, np.zeros((n_more, *rows.shape[1:]), rows.dtype)])
