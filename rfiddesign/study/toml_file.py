"""TOML files from users, checked against a schema; every fault is one line that names file and key."""

import difflib
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from rfiddesign.errors import StudyError

MAX_BYTES = 1_000_000

Model = TypeVar("Model", bound=BaseModel)


def read_toml(path: Path, number: Callable[[str], Any] = float) -> dict[str, Any]:
    """Contents of a TOML file of at most a megabyte, its decimals read by `number`.

    Raises
    ------
    StudyError : if there is no such file or it is not TOML.
    """
    try:
        with path.open("rb") as stream:
            content = stream.read(MAX_BYTES + 1)
    except OSError as error:
        raise StudyError(f"cannot be read: {error.strerror}", file=path) from None
    if len(content) > MAX_BYTES:
        raise StudyError(f"is too large, at most {MAX_BYTES:,} bytes are allowed", file=path)
    try:
        return tomllib.loads(content.decode("utf-8"), parse_float=number)
    except UnicodeDecodeError:
        raise StudyError("is not UTF-8 text", file=path) from None
    # Beside its own error the parser lets through what numbers of thousands of digits and deep nesting cause.
    except (ValueError, ArithmeticError, RecursionError) as error:
        raise StudyError(f"is not TOML: {error}", file=path) from None


def validate(model: type[Model], data: dict[str, Any], path: Path) -> Model:
    """The data as a checked record; StudyError names the first key at fault, what was found and what is allowed."""
    try:
        return model.model_validate(data)
    except ValidationError as error:
        faults = error.errors()
        first = faults[0]
        key = ".".join(str(part) for part in first["loc"])
        problem = _problem(model, first)
        if len(faults) > 1:
            problem += f" (and {len(faults) - 1} more)"
        raise StudyError(problem, file=path, key=key) from None


def _problem(model: type[BaseModel], fault: dict[str, Any]) -> str:
    kind, message = fault["type"], fault["msg"]
    if kind == "extra_forbidden":
        allowed = sorted(_fields_at(model, fault["loc"][:-1]))
        near = difflib.get_close_matches(str(fault["loc"][-1]), allowed, n=1)
        hint = f"did you mean {near[0]}? " if near else ""
        return f"unknown key; {hint}allowed: {', '.join(allowed)}"
    if kind == "missing":
        return "is missing"
    if kind == "value_error":
        return message.removeprefix("Value error, ")
    return f"found {_shortened(fault['input'])}; {message[0].lower()}{message[1:]}"


def _fields_at(model: type[BaseModel], location: tuple[str | int, ...]) -> set[str]:
    current: Any = model
    for part in location:
        field = getattr(current, "model_fields", {}).get(part)
        if field is None:
            continue
        current = record_in(field.annotation)
    return set(getattr(current, "model_fields", {}))


def record_in(annotation: Any) -> Any:
    """The record inside an annotation such as `NoiseSection | None` or `list[ControllerEntry]`."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    for argument in getattr(annotation, "__args__", ()):
        found = record_in(argument)
        if found is not None:
            return found
    return None


def _shortened(value: Any) -> str:
    try:
        text = repr(value)
    except ValueError:
        text = "a number of thousands of digits"
    return text if len(text) <= 60 else f"{text[:57]}..."
