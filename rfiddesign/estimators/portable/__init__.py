"""An estimator made ready, as source code that a robot runs without this package."""

from rfiddesign.estimators.portable.c_source import MAX_TABLE_BYTES, Portable, Words, c_source

__all__ = ["MAX_TABLE_BYTES", "Portable", "Words", "c_source"]
