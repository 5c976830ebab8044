"""A section of the page that only some studies have."""

from dataclasses import dataclass
from typing import Any

from rfiddesign.report.album import Picture


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
    files : (name, text) of what is written beside the page, as tables for a spreadsheet.
    """

    key: str
    title: str
    template: str
    part: Any
    pictures: tuple[Picture, ...] = ()
    files: tuple[tuple[str, str], ...] = ()
