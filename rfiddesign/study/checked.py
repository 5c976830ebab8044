"""Errors of what a study's values are given to, as errors of the study."""

from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from rfiddesign.errors import StudyError

Built = TypeVar("Built")


def checked(path: Path, key: str, build: Callable[[], Built]) -> Built:
    """What `build` returns; its ValueError becomes a StudyError of that file and key."""
    try:
        return build()
    except StudyError:
        raise
    except ValueError as error:
        raise StudyError(str(error), file=path, key=key) from None
