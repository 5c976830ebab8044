"""Readers by name: what they demand of the tags."""

import tomllib
from dataclasses import dataclass
from functools import cache
from importlib import resources


@dataclass(frozen=True)
class Reader:
    """A reader one can buy.

    Parameters
    ----------
    name : as studies call it.
    sees_one_tag_only : it has no anti-collision: two tags in its field at once must never happen.
    source : where this comes from.
    """

    name: str
    sees_one_tag_only: bool
    source: str


@cache
def readers() -> dict[str, Reader]:
    """Every reader of the catalog by name."""
    text = resources.files("rfiddesign.catalog").joinpath("readers.toml").read_text(encoding="utf-8")
    return {name: Reader(name, **entry) for name, entry in tomllib.loads(text).items()}


def reader(name: str) -> Reader:
    """The reader of that name; ValueError lists the names there are."""
    known = readers()
    if name not in known:
        raise ValueError(f"reader is {name!r}, must be one of {', '.join(known)}")
    return known[name]


#: What a design has unless it says otherwise.
USUAL_READER = "hf-anticollision"
