"""--set KEY=VALUE: change keys of a study file from the command line."""

import tomllib
from typing import Any

from pydantic import BaseModel

from rfiddesign.errors import StudyError
from rfiddesign.study.config import DesignSection, StudyFile
from rfiddesign.study.estimator_config import SECTIONS
from rfiddesign.study.toml_file import record_in

SOURCE = "--set"
_WORDS = {"true": True, "on": True, "yes": True, "false": False, "off": False, "no": False}
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
    result = _copy(data)
    pairs = [setting.partition("=") for setting in settings]
    chosen = [parse_value(text.strip()) for name, _, text in pairs if name.strip() == "estimator"]
    estimator = (chosen or [data.get("estimator")])[-1]
    keys = settable_keys(SECTIONS.get(estimator if isinstance(estimator, str) else None, "mcl"))
    for setting in settings:
        name, equals, text = setting.partition("=")
        if not equals:
            raise StudyError(f"found {setting!r}, must be KEY=VALUE", file=SOURCE)
        if name.strip() not in keys:
            names = ", ".join(sorted(key for key in keys if "." not in key))
            raise StudyError(f"unknown key; allowed: {names}, or a dotted path", file=SOURCE, key=name.strip())
        _assign(result, keys[name.strip()], parse_value(text.strip()))
    return result


def parse_value(text: str) -> Any:
    """A TOML value, a word for true or false, or else the text itself."""
    if text.lower() in _WORDS:
        return _WORDS[text.lower()]
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except (ValueError, RecursionError):
        return text


def _paths(model: type[BaseModel], prefix: tuple[str, ...]):
    for name, field in model.model_fields.items():
        inner = record_in(field.annotation)
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
