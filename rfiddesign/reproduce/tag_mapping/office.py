"""The office of tag_mapping_adaptive_likelihood (section V): a robot wanders along passages with tags about."""

import math
from dataclasses import dataclass

import numpy as np

from rfiddesign.estimators.tag_mapping import by_field, by_reads
from rfiddesign.floor.mapped_tags import MappedTags
from rfiddesign.models.lobe import Lobe
from rfiddesign.models.polls import Polls
from rfiddesign.reproduce.progress import OnProgress, counter
from rfiddesign.reproduce.rows import Row, row_of
from rfiddesign.reproduce.tag_mapping.config import OfficeSection, TagMappingFile
from rfiddesign.reproduce.tag_mapping.models import (
    ADAPTIVE,
    FIXED,
    NAMES,
    WITH_DISTANCES,
    field_models,
    fitted,
    lobes,
    mountings,
    papers_models,
)
from rfiddesign.reproduce.workers import in_threads
from rfiddesign.simulation.tag_polls import antenna_poses, poll_tags

PAPER, UHF = "office", "office, UHF sector"
WAYS = ("in contact", "driven")
# Squared Mahalanobis distance in the plane within which half of a Gaussian lies.
_WITHIN_HALF = 2.0 * math.log(2.0)
# A robot at a wall looks further and further around for where it may go.
_WIDER = 1.1


@dataclass(frozen=True, eq=False)
class OfficeDrive:
    """One drive, with where the tags are in truth (n_tags, 2) and the way between two places of the robot [mm]."""

    polls: Polls
    tags_mm: np.ndarray
    step_mm: float
    n_antennas: int

    @property
    def n_places(self) -> int:
        """How often the robot polled."""
        return len(self.polls.poses) // self.n_antennas

    def ways_mm(self, tag: int) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """By either way of counting, how far the robot had come, and after how many polls.

        "in contact": each place at which the tag is read counts, once it was; "driven": the way since the first read.
        """
        places = np.unique(self.polls.read_poll[self.polls.reads_of(tag)] // self.n_antennas)
        contact = np.arange(1, places.size + 1) * self.step_mm
        since = np.arange(places[0], self.n_places)
        driven = (since - places[0] + 1) * self.step_mm
        return {
            "in contact": (contact, (places + 1) * self.n_antennas),
            "driven": (driven, (since + 1) * self.n_antennas),
        }


def wander(section: OfficeSection, duration_s: float, rng: np.random.Generator) -> np.ndarray:
    """Poses (n, 3) of a robot that turns by up to `turn_deg` at each poll; at a wall by as much as it takes."""
    side, step = 1e3 * section.side_m, section.speed_mm_per_s * section.poll_s
    pitch = (side - section.passage_mm) / (section.n_passages - 1)
    wall, inner = section.wall_mm, section.passage_mm - section.wall_mm

    def is_free(x: float, y: float) -> bool:
        is_inside = wall <= min(x, y) and max(x, y) <= side - wall
        return is_inside and (wall <= x % pitch <= inner or wall <= y % pitch <= inner)

    x = y = 0.5 * section.passage_mm
    heading, poses = 0.0, []
    for _ in range(round(duration_s / section.poll_s)):
        most = math.radians(section.turn_deg)
        while True:
            turned = heading + rng.uniform(-most, most)
            to_x, to_y = x + step * math.cos(turned), y + step * math.sin(turned)
            if is_free(to_x, to_y):
                break
            most = min(most * _WIDER, math.pi)
        x, y, heading = to_x, to_y, turned
        poses.append((x, y, heading))
    return np.array(poses)


def drive(file: TagMappingFile, lobe: Lobe, duration_s: float, run: int) -> OfficeDrive:
    """Run `run`: other tags, another way."""
    section, rng = file.office, np.random.default_rng([file.seed, 1, run])
    tags = rng.uniform(0.0, 1e3 * section.side_m, (section.n_tags, 2))
    looks = mountings(file.mapping)
    poses = antenna_poses(wander(section, duration_s, rng), looks)
    polls = poll_tags(lobe, poses, tags, tuple(file.mapping.distances_mm), rng)
    return OfficeDrive(polls, tags, section.speed_mm_per_s * section.poll_s, len(looks))


@dataclass(frozen=True, eq=False)
class OfficeErrors:
    """Errors of a drive [mm]: mean over tags, by way of counting, at marks; and how honest covariances are.

    Parameters
    ----------
    mean_mm : {(model, way): (n_marks,)}, nan where no tag got as far.
    n_tags : {way: (n_marks,)} tags that got as far.
    nees : {model: (n_tags,)} squared errors over covariances in the end, 2 in the mean if these are right.
    """

    mean_mm: dict[tuple[str, str], np.ndarray]
    n_tags: dict[str, np.ndarray]
    nees: dict[str, np.ndarray]


def errors(
    papers: dict[str, by_reads.ByReads], fields: dict[str, by_field.ByField], drive: OfficeDrive, marks_mm: np.ndarray
) -> OfficeErrors:
    """Map the tags of a drive with all models."""
    polls, tags = drive.polls, [tag for tag in range(drive.polls.n_tags) if len(drive.polls.reads_of(tag))]
    found = {(name, way): np.full((len(tags), marks_mm.size), np.nan) for name in (*papers, *fields) for way in WAYS}
    nees = {name: np.empty(len(tags)) for name in fields}
    for i, tag in enumerate(tags):
        ends = {}
        for way, (come, n_polls) in drive.ways_mm(tag).items():
            at = np.searchsorted(come, marks_mm - 1e-6)
            ends[way] = np.where(at < come.size, n_polls[np.minimum(at, come.size - 1)], -1)
        read_at, truth = polls.read_poll[polls.reads_of(tag)], drive.tags_mm[tag]
        for name, settings in papers.items():
            off = np.hypot(*(by_reads.follow(settings, polls, tag)[0] - truth).T)
            for way in WAYS:
                last = np.searchsorted(read_at, ends[way]) - 1
                found[name, way][i] = np.where(ends[way] > 0, off[np.maximum(last, 0)], np.nan)
        asked = np.unique([len(polls.poses), *(end for way in WAYS for end in ends[way] if end > 0)])
        for name, settings in fields.items():
            means, covariances, _ = by_field.follow(settings, polls, tag, asked)
            off = np.hypot(*(means - truth).T)
            for way in WAYS:
                found[name, way][i] = np.where(ends[way] > 0, off[np.searchsorted(asked, ends[way])], np.nan)
            nees[name][i] = (means[-1] - truth) @ np.linalg.solve(covariances[-1], means[-1] - truth)
    first = next(iter(found))[0]
    n_tags = {way: np.isfinite(found[first, way]).sum(axis=0) for way in WAYS}
    mean = {key: column_means(values) for key, values in found.items()}
    return OfficeErrors(mean, n_tags, nees)


def column_means(values: np.ndarray) -> np.ndarray:
    """Means of the columns over what is a number, nan where nothing is."""
    is_there = np.isfinite(values)
    n = is_there.sum(axis=0)
    return np.where(n > 0, np.where(is_there, values, 0.0).sum(axis=0) / np.maximum(n, 1), np.nan)


def measure(
    file: TagMappingFile, published: dict, n_workers: int | None, on_progress: OnProgress, *, is_quick: bool
) -> tuple[list[Row], dict[str, list[OfficeErrors]]]:
    """Both readers; also the errors by reader, run by run, for the figure."""
    section = file.office
    n_runs = section.quick_runs if is_quick else section.runs
    duration_s = section.quick_duration_s if is_quick else section.duration_s
    rows, runs, marks = [], {}, marks_mm(section)
    for table, field in ((PAPER, section.paper), (UHF, section.uhf)):
        count = counter(table, n_runs, on_progress)
        mapping = fitted(file.mapping, field)
        true, believed = lobes(mapping, field)
        papers, fields = papers_models(mapping), field_models(mapping, believed)

        def one(run: int, true: Lobe = true, papers: dict = papers, fields: dict = fields) -> OfficeErrors:
            return errors(papers, fields, drive(file, true, duration_s, run), marks)

        found = []
        for result in in_threads(one, range(n_runs), n_workers):
            found.append(result)
            count()
        runs[table] = found
        rows += _rows(table, section, found, published.get(table, {}))
    return rows, runs


def first_map(file: TagMappingFile, *, is_quick: bool) -> MappedTags:
    """The tags that the first drive of the office with the paper's reader finds, by read field and distances."""
    section = file.office
    mapping = fitted(file.mapping, section.paper)
    true, believed = lobes(mapping, section.paper)
    polls = drive(file, true, section.quick_duration_s if is_quick else section.duration_s, 0).polls
    return by_field.map_tags(field_models(mapping, believed)[WITH_DISTANCES], polls)


def marks_mm(section: OfficeSection) -> np.ndarray:
    """Where errors are asked for: the marks of the table and, between them, those of the figure."""
    n = math.ceil(5 * math.log10(section.marks_m[-1] / 0.4)) if section.marks_m[-1] > 0.4 else 0
    between = np.round(np.geomspace(0.4, section.marks_m[-1], n + 1), 1) if n else []
    return 1e3 * np.unique([*section.marks_m, *between])


def _rows(table: str, section: OfficeSection, found: list[OfficeErrors], published: dict) -> list[Row]:
    marks, rows = marks_mm(section), []
    for way in WAYS:
        for mark in section.marks_m:
            at, row = int(np.searchsorted(marks, 1e3 * mark)), f"{mark:g} m {way}"
            values = {f"{name}_cm": np.array([one.mean_mm[name, way][at] for one in found]) / 10.0 for name in NAMES}
            values["gain_cm"] = values[f"{FIXED}_cm"] - values[f"{ADAPTIVE}_cm"]
            values["tags"] = np.array([one.n_tags[way][at] for one in found], float)
            for metric, value in values.items():
                rows.append(row_of(table, row, metric, value, published.get(row, {}).get(metric)))
    for name, words in NAMES.items():
        if name in found[0].nees:
            nees = [one.nees[name] for one in found]
            row = f"covariance of {words}"
            rows.append(row_of(table, row, "nees", _means(nees)))
            rows.append(row_of(table, row, "within_half_share", _means([one < _WITHIN_HALF for one in nees])))
    return rows


def _means(values: list[np.ndarray]) -> np.ndarray:
    """Mean of each drive, nan where no tag was read."""
    return np.concatenate([column_means(one[:, None]) for one in values])
