"""Sections of the page that only some studies have, each drawn from a file of its own in the result folder."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from rfiddesign.report.album import Picture
from rfiddesign.report.contents import Contents


@dataclass(frozen=True)
class Extra:
    """A section that only some studies have.

    Parameters
    ----------
    key : its anchor on the page.
    title : its name among the links at the top.
    template : the template that it is filled into, as `part`.
    part : what the template says.
    pictures : its figures, found in the template by their topics.
    """

    key: str
    title: str
    template: str
    part: Any
    pictures: tuple[Picture, ...] = ()


#: What looks for each section in a result folder, in the order of the page; None where a study has no such thing.
READERS: tuple[Callable[[Contents], Extra | None], ...] = ()


def extras(contents: Contents) -> tuple[Extra, ...]:
    """The sections that a result folder has beside those that all have."""
    return tuple(extra for read in READERS if (extra := read(contents)) is not None)
