"""As-built survey of a tagged floor: where its tags lie, which are dead, and which were mixed up.

1. *Mixed-up tags.*  The mean place at which a tag was read, c, is off the tag's own place by the reference's error and
   by half a field: about Gaussian with variance s^2 per axis.  Tags i and j are **swapped** if the likelihood that i
   lies about j's place and j about i's, over that of both about their own, exceeds (pairs looked at) / 0.001: of a
   floor without mix-ups a survey lists a pair with a chance below 0.001, by Markov's inequality.  A tag whose c is too
   far from its place at that level and that has no partner is **misplaced**.
2. *Places.*  The posterior of `soft_grid`, from a prior about the nominal place; of a swapped tag about its partner's,
   of a misplaced one about where it was read.
3. *Dead tags.*  A tag that was never read is **dead** if a living one, laid as the prior has it, would have stayed
   silent over all these polls with a chance below 0.001, tag by tag; else it is **unseen**: the survey cannot tell.
   Of n living tags the survey lists 0.001 n on average at most, and fewer once passes are many.  Where another
   tag was found at its place, the prior is about that one's.  A tag that is nowhere near counts as dead, too.
"""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from rfiddesign import require
from rfiddesign.estimators.tag_mapping.soft_grid import (
    ANOTHER,
    NOTHING,
    READ,
    Posterior,
    ReferenceDrift,
    SoftGrid,
    posterior,
    soft_grid,
)
from rfiddesign.floor import TagMap, build_tag_map, visible_tags
from rfiddesign.floor.mapped_tags import MappedTags
from rfiddesign.models.robot import Robot
from rfiddesign.models.survey_log import SurveyLog, SurveyPolls

#: What a survey says of a tag.
FOUND, SWAPPED, MISPLACED, DEAD, UNSEEN = "found", "swapped", "misplaced", "dead", "unseen"
#: Chance of a false alarm: of a pair on a whole floor, of each tag that was never read.
FALSE_ALARM = 1e-3
# What was declared is doubted if offsets are so many times as large or as small.
_FACTOR = 2.0


@dataclass(frozen=True, eq=False)
class SurveyedTags:
    """What a survey found, tag by tag in the order of their ids.

    Parameters
    ----------
    nominal_mm, mean_mm : (n, 2) where the plan has the tag, and where it lies [mm]; of a tag never read the former, or
        the place of the tag that lies there in its stead.
    covariance_mm2 : (n, 2, 2) of the mean; of a tag never read the prior's.
    status : (n,) "found", "swapped", "misplaced", "dead" or "unseen".
    partner : (n,) id of the tag that it was swapped with, -1: none.
    n_reads, n_visits : (n,) reads, and visits with at least one.
    silence : (n,) chance that a living tag would not have been read; 0 of those that were.
    n_unknown : reads of ids that the plan does not have.
    laid_mm : standard deviation per axis of where tags lie about the plan, as their reads have it whatever was
        declared [mm]: the median squared offset of the places where they were read, less what these places scatter by.
    scatter_mm : median standard deviation per axis of where a tag is read about where it lies [mm]; a `laid_mm` of less
        than twice that is hardly told from it.
    is_as_declared : False if these offsets, scatter included, are over twice or under half of what was declared; under
        half only where more than the scatter was declared, which is rather said too large.
    """

    nominal_mm: np.ndarray
    mean_mm: np.ndarray
    covariance_mm2: np.ndarray
    status: np.ndarray
    partner: np.ndarray
    n_reads: np.ndarray
    n_visits: np.ndarray
    silence: np.ndarray
    n_unknown: int
    laid_mm: float
    scatter_mm: float
    is_as_declared: bool

    @property
    def is_read(self) -> np.ndarray:
        """Tags that were read (n,)."""
        return self.n_reads > 0

    @property
    def sigma_mm(self) -> float:
        """Root mean square of the standard deviations per axis of the tags that were read [mm]."""
        return math.sqrt(float(np.trace(self.covariance_mm2[self.is_read], axis1=1, axis2=2).mean()) / 2)

    @property
    def map_mm(self) -> tuple[np.ndarray, np.ndarray]:
        """The map to use from now on: ids (k,) of all but the dead, and their places (k, 2)."""
        kept = np.flatnonzero(self.status != DEAD)
        return kept, self.mean_mm[kept]

    @property
    def mapped(self) -> MappedTags:
        """The tags that were read, with covariances."""
        read = np.flatnonzero(self.is_read)
        return MappedTags(read, self.mean_mm[read], self.covariance_mm2[read], self.n_reads[read])

    def swapped_pairs(self) -> list[tuple[int, int]]:
        """Ids of the tags that lie at each other's place."""
        return [(i, int(self.partner[i])) for i in np.flatnonzero(self.partner >= 0).tolist() if i < self.partner[i]]


@dataclass(frozen=True, eq=False)
class _Material:
    """All polls of a survey, ready to be looked up by place and by tag."""

    polls: SurveyPolls
    by_place: TagMap
    tag_start: np.ndarray
    tag_poll: np.ndarray
    reference: ReferenceDrift
    gap_s: float

    def reads_of(self, tag: int) -> np.ndarray:
        """Polls that read a tag, rising."""
        return self.tag_poll[self.tag_start[tag] : self.tag_start[tag + 1]]

    def visits(self, polls: np.ndarray) -> np.ndarray:
        """First of each visit among rising polls, and their number at the end."""
        times, stretches = self.polls.time_s[polls], self.polls.stretch[polls]
        is_new = (np.diff(times) > self.gap_s) | (np.diff(stretches) != 0)
        starts = [0, *(np.flatnonzero(is_new) + 1).tolist()] if len(polls) else []
        return np.array([*starts, len(polls)], np.int64)


def survey_tags(
    log: SurveyLog, robot: Robot, nominal_mm: np.ndarray, installation_mm: float, reference: ReferenceDrift,
    apply: Callable[[Callable[[int], Posterior], Iterable[int]], Iterable[Posterior]] = map,
) -> SurveyedTags:  # fmt: skip
    """Estimate where each tag of a floor lies from a survey's log.

    Parameters
    ----------
    log : what was recorded; reads carry ids from 0 to n - 1, the rows of `nominal_mm`.
    robot : its antennas and how they read; a chance to read of 1 would make one lost read a proof: give less.
    nominal_mm : (n, 2) where the plan has the tags [mm].
    installation_mm : standard deviation per axis of how far off it they lie, as declared [mm].
    reference : error of the reference localizer.
    apply : `map`, or one that shares the work among threads.

    Raises
    ------
    ValueError : if the log does not fit the robot, has no read of a tag of the plan, or a number is out of bounds.
    """
    require.within("read_probability", robot.reads.read_probability, low=0.01, high=0.999)
    nominal = np.asarray(nominal_mm, float)
    n, visit_s = len(nominal), _visit_s(log, robot)
    material, n_unknown = _material(log, robot, n, reference, visit_s)
    if not len(material.tag_poll):
        raise ValueError(f"log: no read of a planned tag; {n_unknown:,} reads of ids that the plan does not have")
    n_reads = np.diff(material.tag_start)
    centres, n_visits, worth = _read_places(material, nominal)
    scatter = _scatter(robot, reference, worth)
    spread = np.sqrt(installation_mm**2 + scatter**2)
    status, partner, about = _sorted_out(nominal, centres, spread, n_reads)
    grid = soft_grid(robot, reference, installation_mm, visit_s)
    anywhere_mm = math.hypot(reference.pose_mm, robot.area.reach_mm)
    wide = soft_grid(robot, reference, anywhere_mm, visit_s) if np.any(status == MISPLACED) else grid

    def place(i: int) -> Posterior:
        return _posterior(material, wide if status[i] == MISPLACED else grid, i, about[i])

    means, covariances, silence = np.empty((n, 2)), np.empty((n, 2, 2)), np.zeros(n)
    for i, found in enumerate(apply(place, range(n))):
        means[i], covariances[i] = about[i] + found.mean_mm, found.covariance_mm2
        if n_reads[i] == 0:
            means[i], covariances[i] = about[i], installation_mm**2 * np.eye(2)
            silence[i] = math.exp(min(found.log_evidence, 0.0))
            status[i] = DEAD if silence[i] < FALSE_ALARM else UNSEEN
    return SurveyedTags(
        nominal, means, covariances, status, partner, n_reads, n_visits, silence, n_unknown,
        *_as_laid((centres - nominal)[n_reads > 0], scatter[n_reads > 0], installation_mm),
    )  # fmt: skip


def _sorted_out(
    nominal: np.ndarray, centres: np.ndarray, spread: np.ndarray, n_reads: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Status and partner (n,) of each tag, and the place (n, 2) about which it is to be sought."""
    n, partner = len(nominal), _swapped(nominal, centres, spread)
    status = np.where(partner >= 0, SWAPPED, FOUND).astype("<U9")
    far = np.sum((centres - nominal) ** 2, axis=1) > 2.0 * spread**2 * math.log(max(n, 1) / FALSE_ALARM)
    is_misplaced = (n_reads > 0) & (partner < 0) & far
    status[is_misplaced] = MISPLACED
    about = np.where((partner >= 0)[:, None], nominal[partner], nominal)
    about[is_misplaced] = centres[is_misplaced]
    for j in np.flatnonzero(is_misplaced).tolist():
        owner = int(np.argmin(np.sum((nominal - centres[j]) ** 2, axis=1)))
        if n_reads[owner] == 0:
            # The two were swapped, and where the other one is the robot heard nothing.
            about[owner] = nominal[j]
    return status, partner, about


def _visit_s(log: SurveyLog, robot: Robot) -> float:
    """How long a tag is under a robot that passes over it."""
    places = np.asarray(robot.layout.poses_mm)[:, :2]
    length = float(np.ptp(places, axis=0).max()) + 2.0 * robot.area.reach_mm
    return length / max(log.mean_speed_mm_per_s, 1.0)


def _material(
    log: SurveyLog, robot: Robot, n_tags: int, reference: ReferenceDrift, visit_s: float
) -> tuple[_Material, int]:
    polls = log.polls(robot.layout)
    is_known = (polls.read_tag >= 0) & (polls.read_tag < n_tags)
    tags, reading = polls.read_tag[is_known], polls.read_poll[is_known]
    by_tag = np.lexsort((reading, tags))
    start = np.searchsorted(tags[by_tag], np.arange(n_tags + 1))
    by_place = build_tag_map(polls.antenna_poses[:, :2])
    found = _Material(polls, by_place, start, reading[by_tag], reference, visit_s)
    return found, int(np.count_nonzero(~is_known))


def _read_places(material: _Material, nominal: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mean place of the antennas that read each tag (n, 2), visits (n,), and independent visits that they are worth."""
    centres, n_visits, worth = nominal.copy(), np.zeros(len(nominal), np.int64), np.ones(len(nominal))
    for i in range(len(nominal)):
        reads = material.reads_of(i)
        if not len(reads):
            continue
        start = material.visits(reads)
        places = material.polls.antenna_poses[reads, :2]
        of_visits = np.add.reduceat(places, start[:-1]) / np.diff(start)[:, None]
        weights = material.reference.visit_weights(material.polls.time_s[reads[start[:-1]]])
        centres[i], n_visits[i], worth[i] = weights @ of_visits / weights.sum(), len(weights), weights.sum()
    return centres, n_visits, worth


def _scatter(robot: Robot, reference: ReferenceDrift, worth: np.ndarray) -> np.ndarray:
    """Standard deviation per axis of where a tag is read about where it lies (n,); reads come from all of the field."""
    field = max(robot.area.covariance_mm2[0][0], robot.area.covariance_mm2[1][1])
    return np.sqrt((reference.pose_mm**2 + field) / worth)


def _as_laid(offsets: np.ndarray, scatter: np.ndarray, declared_mm: float) -> tuple[float, float, bool]:
    """How far off tags lie from the plan, the scatter of where they were read, and whether that is as declared.

    Of a Gaussian in the plane the median squared distance is 2 ln 2 variances; mixed-up tags do not move it.
    """
    seen = float(np.median(np.sum(offsets**2, axis=1))) / (2.0 * math.log(2.0))
    own = float(np.median(scatter**2))
    ratio = seen / (declared_mm**2 + own)
    # Reads come from less than all of the field: its own scatter is said too large, which alone is no reason to doubt.
    is_too_small = ratio <= 1.0 / _FACTOR**2 and declared_mm**2 > own
    return math.sqrt(max(seen - own, 0.0)), math.sqrt(own), not is_too_small and ratio < _FACTOR**2


def _swapped(nominal: np.ndarray, centres: np.ndarray, spread: np.ndarray) -> np.ndarray:
    """Id of the tag that each was swapped with, -1: none."""
    partner = np.full(len(nominal), -1)
    if len(nominal) < 2:
        return partner
    tree = cKDTree(nominal)
    nearest = tree.query(centres)[1]
    # Every pair of neighbours might have been swapped; those that were not are not looked at one by one.
    threshold = math.log(len(nominal) * (len(nominal) - 1) / 2 / FALSE_ALARM)

    def misfit(i: int, j: int) -> float:
        return float(np.sum((centres[i] - nominal[j]) ** 2)) / (2.0 * spread[i] ** 2)

    for i, j in enumerate(nearest.tolist()):
        if i < j and nearest[j] == i and misfit(i, i) + misfit(j, j) - misfit(i, j) - misfit(j, i) > threshold:
            partner[i], partner[j] = j, i
    return partner


def _posterior(material: _Material, grid: SoftGrid, tag: int, centre: np.ndarray) -> Posterior:
    # Which silent polls are looked at depends on their places alone, so that nothing is biased by it.
    near = visible_tags(material.by_place, float(centre[0]), float(centre[1]), grid.near_mm)
    reads = material.reads_of(tag)
    near = np.union1d(near, reads)
    offsets = material.polls.antenna_poses[near] - np.array([*centre, 0.0])
    is_read = np.isin(near, reads, assume_unique=True)
    outcome = np.where(is_read, READ, np.where(material.polls.has_read[near], ANOTHER, NOTHING))
    start = material.visits(near)
    return posterior(grid, offsets, outcome, start, _weights(material, near, start, is_read))


def _weights(material: _Material, polls: np.ndarray, start: np.ndarray, is_read: np.ndarray) -> np.ndarray:
    """Weights of visits: of those that read the tag among themselves, of the silent ones among all."""
    if len(start) < 2:
        return np.empty(0)
    times = material.polls.time_s[polls[start[:-1]]]
    weights = material.reference.visit_weights(times)
    has_read = np.add.reduceat(is_read.astype(np.int64), start[:-1]) > 0
    weights[has_read] = material.reference.visit_weights(times[has_read])
    return weights


def mean_correction_mm(surveyed: SurveyedTags) -> float:
    """Mean distance by which the survey moved the tags that it found where they belong [mm]."""
    found = surveyed.status == FOUND
    return float(np.hypot(*(surveyed.mean_mm - surveyed.nominal_mm)[found].T).mean()) if found.any() else 0.0
