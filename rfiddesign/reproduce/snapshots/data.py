"""Data sets of a reproduction of snapshots: drives through a place, each on its own day, and how they are split."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

from rfiddesign.floor.scene import Scene
from rfiddesign.floor.scenes import corridor, laboratory
from rfiddesign.models.snapshots import SnapshotLog
from rfiddesign.models.uhf import UhfField, UhfWorld
from rfiddesign.reproduce.snapshots.config import CountsSection, SnapshotsFile
from rfiddesign.simulation.snapshot_drive import record_snapshots

LAB, LOWER, HIGHER = "lab", "lower", "higher"
# Training sets of a data set begin so many drives after each other.
_NEXT_FOLD = 2


@lru_cache(maxsize=8)
def scene_of(place: str) -> Scene:
    """The laboratory, or the corridor with few or many tags."""
    return laboratory() if place == LAB else corridor(place)


@dataclass(frozen=True)
class Fold:
    """A training set and the drives to localize on: numbers of drives."""

    training: tuple[int, ...]
    validation: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class DataSet:
    """Drives through a place in a world; drive i was driven on day i, or all on one day."""

    file: SnapshotsFile
    place: str
    world: int
    n_cycles: int
    logs: tuple[SnapshotLog, ...]

    @property
    def scene(self) -> Scene:
        """The place."""
        return scene_of(self.place)

    def field(self, day: int) -> UhfWorld:
        """What is true on a day."""
        return world_of(self.file, self.place, self.world, day)


def data_set(file: SnapshotsFile, place: str, world: int, n_cycles: int, *, is_one_day: bool = False) -> DataSet:
    """Drive as often as the study file says."""
    scene, seed = scene_of(place), file.seed + world
    logs = tuple(
        record_snapshots(
            world_of(file, place, world, 0 if is_one_day else i), scene, file.drive.settings(), n_cycles, seed=seed,
            day=i, number=i,
        )
        for i in range(file.n_logs)
    )  # fmt: skip
    return DataSet(file, place, world, n_cycles, logs)


def world_of(file: SnapshotsFile, place: str, world: int, day: int) -> UhfWorld:
    """A place in one of the study's worlds on a day."""
    field = UhfField(**file.uhf.model_dump(exclude_none=True))
    return UhfWorld(scene_of(place), field, seed=file.seed + world, day=day)


def folds(n_logs: int, n_cycles: int, counts: CountsSection) -> Iterator[Fold]:
    """As many drives to train on as a snapshot has cycles (section V-B), the others to localize on."""
    for k in range(counts.folds):
        training = tuple((_NEXT_FOLD * k + i) % n_logs for i in range(n_cycles))
        rest = [(training[-1] + 1 + i) % n_logs for i in range(n_logs - n_cycles)]
        yield Fold(training, tuple(rest[: counts.validations]))
