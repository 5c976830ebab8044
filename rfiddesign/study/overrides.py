"""Change keys of a study's data: from the command line (--set KEY=VALUE), and for a variant of the study."""

import tomllib
import typing
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from rfiddesign.errors import StudyError
from rfiddesign.study.config import DesignSection, StudyFile
from rfiddesign.study.estimator_config import AUTO, AUTO_ESTIMATORS, SECTIONS
from rfiddesign.study.toml_file import record_in

SOURCE = "--set"
_WORDS = {"true": True, "on": True, "yes": True, "false": False, "off": False, "no": False}
# Which variants a study has, and how they are compared, is not among what a variant may change.
NOT_SETTABLE = ("variants", "comparison")
# What is asked beside the search for a design takes no short name from it: its keys have dotted paths alone.
_DOTTED_ONLY = ("shelves.", "survey.")
# A design names its density in one of two ways: setting one drops the other.
_EXCLUSIVE = {"design.tags_per_m2": "pitch_mm", "design.pitch_mm": "tags_per_m2"}


def settable_keys(section: str = "mcl") -> dict[str, str]:
    """Short name of every settable key to its dotted path; a path is a name of itself.

    A name that several estimators have means that of the estimator set by `section`; one that the world has, too, means
    the world.
    """
    paths = list(_paths(StudyFile, ()))
    names: dict[str, list[str]] = {}
    for path in paths:
        if not path.startswith(_DOTTED_ONLY):
            names.setdefault(path.rsplit(".", 1)[-1], []).append(path)
    short = {name: found[0] for name, found in names.items() if len(found) == 1}
    short |= {name: f"{section}.{name}" for name, found in names.items() if f"{section}.{name}" in found}
    # What is true comes before what a filter believes of it.
    short |= {name: f"world.{name}" for name, found in names.items() if f"world.{name}" in found}
    # A variable of the space means the design at hand.
    short |= {name: f"design.{name}" for name in DesignSection.model_fields}
    return short | {path: path for path in paths}


def apply_overrides(data: dict[str, Any], settings: tuple[str, ...]) -> dict[str, Any]:
    """A copy of a study file's data with each KEY=VALUE set; StudyError for an unknown key."""
    pairs = []
    for setting in settings:
        name, equals, text = setting.partition("=")
        if not equals:
            raise StudyError(f"found {setting!r}, must be KEY=VALUE", file=SOURCE)
        pairs.append((name.strip(), parse_value(text.strip())))
    return with_values(data, pairs, SOURCE)


def with_values(data: dict[str, Any], pairs: Iterable[tuple[str, Any]], source: str | Path) -> dict[str, Any]:
    """A copy of a study file's data with keys set to values; StudyError for an unknown key of that `source`."""
    result = _copy(data)
    for path, value in resolved(data, pairs, source):
        _assign(result, path, value)
    return result


def resolved(data: dict[str, Any], pairs: Iterable[tuple[str, Any]], source: str | Path) -> list[tuple[str, Any]]:
    """Keys, short or dotted, as dotted paths of a study file with these data; a table's are those of the keys in it."""
    pairs = list(pairs)
    keys = settable_keys(_own_section(data, pairs))
    found = []
    for name, value in _leaves(pairs, keys):
        if name not in keys:
            names = ", ".join(sorted(key for key in keys if "." not in key))
            raise StudyError(f"unknown key; allowed: {names}, or a dotted path", file=source, key=name)
        found.append((keys[name], value))
    return found


def _own_section(data: dict[str, Any], pairs: list[tuple[str, Any]]) -> str:
    """The table of the estimator set last; where the search chooses one, of the one that it prefers."""
    estimator = next((value for name, value in reversed(pairs) if name == "estimator"), data.get("estimator"))
    if estimator == AUTO:
        space = data.get("space")
        given = space.get("estimator") if isinstance(space, dict) else None
        given = next((value for name, value in reversed(pairs) if name == "space.estimator"), given)
        estimator = given[0] if isinstance(given, list) and given else AUTO_ESTIMATORS[0]
    return SECTIONS.get(estimator if isinstance(estimator, str) else None, "mcl")


def parse_value(text: str) -> Any:
    """A TOML value, a word for true or false, or else the text itself."""
    if text.lower() in _WORDS:
        return _WORDS[text.lower()]
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except (ValueError, RecursionError):
        return text


def _leaves(pairs: Iterable[tuple[str, Any]], keys: dict[str, str], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Pairs of key and value; of a table of the study file those in it."""
    for key, value in pairs:
        name = f"{prefix}{key}"
        if isinstance(value, dict) and any(path.startswith(f"{name}.") for path in keys):
            yield from _leaves(value.items(), keys, f"{name}.")
        else:
            yield name, value


def _paths(model: type[BaseModel], prefix: tuple[str, ...]):
    for name, field in model.model_fields.items():
        if name in NOT_SETTABLE:
            continue
        # The records of a list, or those that a study names itself, have no keys of their own: they are set as a whole.
        inner = None if typing.get_origin(field.annotation) in (list, dict) else record_in(field.annotation)
        if inner is None:
            yield ".".join((*prefix, name))
        else:
            yield from _paths(inner, (*prefix, name))


def _assign(data: dict[str, Any], path: str, value: Any) -> None:
    *tables, key = path.split(".")
    for table in tables:
        data = data.setdefault(table, {})
        if not isinstance(data, dict):
            return  # the file has a value in place of a table, and its check will say so
    data.pop(_EXCLUSIVE.get(path), None)
    data[key] = value


def _copy(data: Any) -> Any:
    return {key: _copy(value) for key, value in data.items()} if isinstance(data, dict) else data
