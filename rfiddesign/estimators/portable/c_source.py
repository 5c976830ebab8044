"""The projected-moment Gaussian filter as one C99 file: templates that mirror its kernels, with a design's numbers.

`mixture.c.jinja` mirrors `_mixture_kernels`, `projection.c.jinja` `_projection_kernels`, and so on; functions have the
names of the kernels.  Constants come from the kernels' modules.
"""

import textwrap
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from rfiddesign import __version__
from rfiddesign.estimators.pmg import Pmg
from rfiddesign.estimators.portable.numbers import numbers_of
from rfiddesign.estimators.verbs import Filter
from rfiddesign.floor import TagMap

PACKAGE = "rfiddesign.estimators.portable"
TEMPLATE = "pmg.c.jinja"
# What follows the numbers, in the order in which C wants it.
PARTS = ("math", "mixture", "projection", "border", "plane", "hypotheses", "hearing", "step", "start")
# Map and field: beyond this a compiler takes minutes, and no robot's computer wants them as source.
MAX_TABLE_BYTES = 8_000_000
_WIDTH = 118


@dataclass(frozen=True)
class Words:
    """What the comment at the top says of where the numbers come from.

    Parameters
    ----------
    study, title, design : names of them.
    bounds_mm : box that a robot which knows nothing is in, (low_x, low_y, high_x, high_y) [mm].
    """

    study: str
    title: str
    design: str
    bounds_mm: tuple[float, float, float, float]


@dataclass(frozen=True)
class Portable:
    """An estimator as source code.

    Parameters
    ----------
    text : the file.
    n_tags : tags of its map; 0: it needs none.
    table_bytes : memory of its map and its field, constant.
    state_bytes : memory of its state.
    """

    text: str
    n_tags: int
    table_bytes: int
    state_bytes: int


def c_source(ready: Filter, tags: TagMap | None, words: Words) -> Portable:
    """A projected-moment Gaussian filter as C99 source; the same bytes for the same arguments.

    Parameters
    ----------
    tags : the map of all tags; without one nothing is learned from polls that read nothing.

    Raises
    ------
    ValueError : if the filter is another, or map and field take more than `MAX_TABLE_BYTES`.
    """
    if not isinstance(ready.settings, Pmg):
        raise ValueError(f"the filter is {type(ready.settings).__name__}, must be Pmg")
    numbers = numbers_of(ready, tags)
    if numbers["table_bytes"] > MAX_TABLE_BYTES:
        raise ValueError(
            f"the map of {numbers['n_tags']:,} tags and the field would take {numbers['table_bytes']:,} bytes on the"
            f" robot, at most {MAX_TABLE_BYTES:,} are written into one file; take fewer tags, or learns_from_nothing ="
            " false, which needs no map"
        )
    environment = Environment(
        loader=PackageLoader(PACKAGE, "."),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    text = environment.get_template(TEMPLATE).render(
        n=numbers,
        facts=_facts(numbers, words),
        bounds="".join(f", {bound:.10g}" for bound in words.bounds_mm),
        version=__version__,
        licence="MIT licence, see LICENSE of rfiddesign.",
        parts=[f"{part}.c.jinja" for part in PARTS],
        block=_block,
        listed=_listed,
        braced=_braced,
    )
    return Portable(text, numbers["n_tags"], numbers["table_bytes"], numbers["state_bytes"])


def _facts(numbers: dict[str, Any], words: Words) -> list[str]:
    """What the file is, a paragraph each."""
    tags = f"{numbers['n_tags']} tags" if numbers["n_tags"] else "no map: it learns from reads alone"
    return [
        f"Study: {words.study}: {words.title}",
        f"Design: {words.design}; {numbers['n_antennas']} antennas; {tags}",
        f"Polls: {_polls(numbers)}",
        f"Memory: {numbers['table_bytes']} bytes of constant tables (map and field), {numbers['state_bytes']} bytes for"
        " a state (where a double has 8); numbers are in double precision.",
    ]


def _polls(numbers: dict[str, Any]) -> str:
    """When antennas poll, which tells a poll that read nothing from none."""
    if numbers["period"] == 1:
        phases = ", at the fractions of it that pmg_phases has" if numbers["learns_from_nothing"] else ""
        return f"every antenna in every step{phases}"
    return (
        f"the antennas take turns over {numbers['period']} steps, see pmg_slots; the first step after pmg_init_... is"
        " the first of them"
    )


def _block(paragraphs: Iterable[str]) -> str:
    """Paragraphs within a C comment."""
    lines = []
    for paragraph in paragraphs:
        lines += textwrap.wrap(_harmless(paragraph), _WIDTH - 3, subsequent_indent="    ")
    return "\n".join(f" * {line}" for line in lines)


def _harmless(text: str) -> str:
    """Text that neither ends a comment nor begins one, nor is a trigraph, nor hides anything."""
    text = " ".join("".join(sign if sign.isprintable() else " " for sign in text).split())
    for pair in ("*/", "/*", "??"):
        while pair in text:
            text = text.replace(pair, f"{pair[0]} {pair[1]}")
    return text


def _braced(row: Iterable[str]) -> str:
    return "{" + ", ".join(row) + "}"


def _listed(values: Iterable[str], indent: int) -> str:
    """Values of an array in lines."""
    margin, lines, line = " " * indent, [], ""
    for value in values:
        if line and len(line) + len(value) + 2 > _WIDTH - indent:
            lines.append(line.rstrip())
            line = ""
        line += f"{value}, "
    lines.append(line.rstrip(", "))
    return "\n".join(margin + line for line in lines)
