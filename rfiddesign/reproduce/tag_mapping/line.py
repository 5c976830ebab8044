"""The line experiments of tag_mapping_adaptive_likelihood (section IV-B): past one tag, turn, and back."""

from dataclasses import dataclass

import numpy as np

from rfiddesign.estimators.tag_mapping import by_reads
from rfiddesign.models.polls import Polls
from rfiddesign.reproduce.progress import OnProgress, counter
from rfiddesign.reproduce.rows import Row, row_of
from rfiddesign.reproduce.tag_mapping.config import TagMappingFile
from rfiddesign.reproduce.tag_mapping.models import ADAPTIVE, FIXED, mountings, papers_lobe, papers_models
from rfiddesign.reproduce.workers import in_threads
from rfiddesign.simulation.tag_polls import antenna_poses, poll_tags

TABLE, LENGTHS, SIGNALS = "line", "ellipse length", "signal"
GAINS = ("fixed_cm", "adaptive_cm", "gain_cm")
METRICS = (
    *GAINS, "fixed_after_cm", "adaptive_after_cm", "gain_after_cm", "read_again_cm",
)  # fmt: skip
Published = dict[str, dict[str, float]]


@dataclass(frozen=True, eq=False)
class LineDrive:
    """One drive past the tag and back.

    Parameters
    ----------
    polls : of all antennas; those of one place follow each other.
    driven_mm : (n_places,) how far the robot had driven at each place.
    n_before : places before the turn.
    tag_mm : where the tag is.
    """

    polls: Polls
    driven_mm: np.ndarray
    n_before: int
    tag_mm: np.ndarray

    @property
    def read_at(self) -> np.ndarray:
        """Places of the reads (n_reads,)."""
        return self.polls.read_poll * self.driven_mm.size // len(self.polls.poses)


def drive(file: TagMappingFile, offset_mm: float, signal_db: float, run: int) -> LineDrive:
    """Run `run`: the first poll comes anywhere within the way between two; the turn takes no poll."""
    line = file.line
    phase = np.random.default_rng([file.seed, run]).uniform(0.0, line.poll_mm)
    driven = np.arange(phase, 2.0 * line.length_mm, line.poll_mm)
    is_before = driven <= line.length_mm
    x, heading = np.where(is_before, driven, 2.0 * line.length_mm - driven), np.where(is_before, 0.0, np.pi)
    poses = antenna_poses(np.column_stack([x, np.zeros_like(x), heading]), mountings(file.mapping))
    tag = np.array([line.tag_at_mm, offset_mm])
    polls = poll_tags(
        papers_lobe(file.mapping), poses, tag[None], tuple(file.mapping.distances_mm), np.random.default_rng(0),
        signal_db=signal_db,
    )  # fmt: skip
    return LineDrive(polls, driven, int(is_before.sum()), tag)


def errors(settings: by_reads.ByReads, past: LineDrive) -> np.ndarray:
    """Error [mm] after each place, nan before the first read (n_places,)."""
    places, _ = by_reads.follow(settings, past.polls, 0)
    if len(places) == 0:
        return np.full(past.driven_mm.size, np.nan)
    off = np.hypot(*(places - past.tag_mm).T)
    last = np.searchsorted(past.read_at, np.arange(past.driven_mm.size), side="right") - 1
    return np.where(last >= 0, off[np.maximum(last, 0)], np.nan)


def metrics_of(models: dict[str, by_reads.ByReads], past: LineDrive) -> dict[str, float]:
    """Errors just before the turn and in the end, and where the tag is read again after the turn [cm]."""
    found = {name: errors(settings, past) / 10.0 for name, settings in models.items()}
    again = past.read_at[past.read_at >= past.n_before]
    before, after = ({name: error[i] for name, error in found.items()} for i in (past.n_before - 1, -1))
    return {
        "fixed_cm": before[FIXED],
        "adaptive_cm": before[ADAPTIVE],
        "gain_cm": before[FIXED] - before[ADAPTIVE],
        "fixed_after_cm": after[FIXED],
        "adaptive_after_cm": after[ADAPTIVE],
        "gain_after_cm": after[FIXED] - after[ADAPTIVE],
        "read_again_cm": past.driven_mm[again[0]] / 10.0 if again.size else np.nan,
    }


def measure(
    file: TagMappingFile, published: dict[str, Published], n_workers: int | None, on_progress: OnProgress, *,
    is_quick: bool,
) -> list[Row]:  # fmt: skip
    """All offsets with and without desk, and what becomes of them with other ellipses and signals."""
    line, rows = file.line, []
    n_runs = line.quick_runs if is_quick else line.runs
    cases = [
        (TABLE, f"L={offset / 10:g}{desk}", offset, signal, None)
        for desk, signal in (("", line.free_db), (" desk", line.desk_db))
        for offset in line.offsets_mm
    ]
    cases += [
        (LENGTHS, f"{length / 1e3:g} m, L={offset / 10:g}", offset, line.free_db, length)
        for length in line.lengths_mm
        for offset in line.offsets_mm
    ]
    cases += [
        (SIGNALS, f"{signal:+g} dB, L={offset / 10:g}", offset, signal, None)
        for signal in line.signals_db
        for offset in line.offsets_mm
    ]
    count = counter("line experiments", len(cases), on_progress)

    def errors_of(case: tuple) -> list[dict[str, float]]:
        _, _, offset, signal, length = case
        models = papers_models(file.mapping, length)
        return [metrics_of(models, drive(file, offset, signal, run)) for run in range(n_runs)]

    for (table, row, *_), runs in zip(cases, in_threads(errors_of, cases, n_workers), strict=True):
        printed = published.get(table, {}).get(row, {})
        for metric in METRICS if table == TABLE else GAINS:
            rows.append(row_of(table, row, metric, np.array([run[metric] for run in runs]), printed.get(metric)))
        count()
    return rows
