"""The variants of a study: the studies that its file names, each read and checked like one of its own."""

import difflib
import json
import re
import unicodedata
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rfiddesign.errors import StudyError
from rfiddesign.results.folder import FIGURES
from rfiddesign.study.overrides import NOT_SETTABLE, resolved, with_values
from rfiddesign.study.variants_config import VariantSection

if TYPE_CHECKING:
    from rfiddesign.study.load import Study

MAX_TITLE = 200


@dataclass(frozen=True)
class Variant:
    """A variant of a study.

    Parameters
    ----------
    section : its entry in the study file.
    folder : name of the folder of its results, within that of the study's.
    settings : what it sets: dotted keys, values as text.
    study : the complete study that it is.
    """

    section: VariantSection
    folder: str
    settings: dict[str, str]
    study: "Study"

    @property
    def name(self) -> str:
        """Its name."""
        return self.section.name

    def listed(self) -> dict[str, Any]:
        """What it is, as data that print as JSON."""
        section = self.section
        return {"name": self.name, "group": section.row, "condition": section.condition, "set": self.settings}


def read_variants(
    base: "Study", data: dict[str, Any], build: Callable[[dict[str, Any]], "Study"]
) -> tuple[Variant, ...]:
    """The variants of a study, of which `data` are its file's and `build` makes a study of changed data.

    Raises
    ------
    StudyError : for anything at fault in a variant, naming the variant.
    """
    sections, path = base.file.variants, base.path
    _check_base(base)
    folders: dict[str, str] = {}
    variants = []
    for section in sections:
        with in_variant(section.name):
            folder = folder_name(section.name)
            if folder in ("", FIGURES):
                raise StudyError(f"gives the folder {folder!r}; choose another name", file=path)
            if folder in folders:
                raise StudyError(f"gives the same folder {folder} as {folders[folder]!r}; rename one", file=path)
            folders[folder] = section.name
            pairs = _pairs(base, data, section)
            settings = {key: json.dumps(value, ensure_ascii=False, default=str) for key, value in pairs}
            variants.append(Variant(section, folder, settings, build(_changed(base, data, section.name, pairs))))
    return tuple(variants)


def variant_of(study: "Study", name: str | None, option: str) -> "Study":
    """The study that a variant is, by name; the study itself for None.

    Raises
    ------
    StudyError : if the study has no such variant, naming the `option` that asked for it.
    """
    if name is None:
        return study
    found = {variant.name: variant.study for variant in study.variants}
    if name in found:
        return found[name]
    if not found:
        raise StudyError(f"found {name!r}, but the study has no variants", file=option)
    near = difflib.get_close_matches(name, found, n=1)
    hint = f"did you mean {near[0]!r}? " if near else ""
    raise StudyError(f"found {name!r}; {hint}must be one of {', '.join(found)}", file=option)


@contextmanager
def in_variant(name: str) -> Iterator[None]:
    """Name the variant in every StudyError of the block, between file and key."""
    try:
        yield
    except StudyError as error:
        where = f"variant {name!r}"
        key = f"{where}: {error.key}" if error.key else where
        raise StudyError(error.problem, file=error.file, key=key) from None


def folder_name(name: str) -> str:
    """A name as that of a folder: lower case, runs of all but letters, digits and _ as one hyphen."""
    return re.sub(r"\W+", "-", unicodedata.normalize("NFC", name).lower()).strip("-_")


def _pairs(base: "Study", data: dict[str, Any], section: VariantSection) -> list[tuple[str, Any]]:
    """Dotted keys that a variant sets, with their values."""
    for key in section.set:
        if key.partition(".")[0] in NOT_SETTABLE:
            raise StudyError("cannot be set by a variant", file=base.path, key=key)
    return resolved(data, section.set.items(), base.path)


def _changed(base: "Study", data: dict[str, Any], name: str, pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """The data of a study file as a variant sets them; the title names the variant unless it sets one."""
    own = {key: value for key, value in data.items() if key not in NOT_SETTABLE}
    title = base.file.title[: MAX_TITLE - len(name) - 3]
    return with_values({**own, "title": f"{title} ({name})"}, pairs, base.path)


def _check_base(study: "Study") -> None:
    """Raise StudyError if savings are to be counted against a group that is none."""
    base, groups = study.file.comparison.base, dict.fromkeys(variant.row for variant in study.file.variants)
    if base is None or base in groups:
        return
    allowed = f"must be one of the groups {', '.join(groups)}" if groups else "but the study has no variants"
    raise StudyError(f"found {base!r}, {allowed}", file=study.path, key="comparison.base")
