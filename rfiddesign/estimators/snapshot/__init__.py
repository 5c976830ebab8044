"""Monte-Carlo localization by RFID snapshots, without a sensor model (uhf_snapshots)."""

from rfiddesign.estimators.snapshot.likelihood import log_likelihood
from rfiddesign.estimators.snapshot.mcl import SnapshotBelief, SnapshotFilter, SnapshotMcl, build, init, track

__all__ = [
    "SnapshotBelief", "SnapshotFilter", "SnapshotMcl", "build", "init", "log_likelihood", "track",
]  # fmt: skip
