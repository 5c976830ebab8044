"""From templates, style sheets and figures to pages that load nothing and trust no text."""

import re
from dataclasses import dataclass
from importlib import resources
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from rfiddesign.report.album import Picture
from rfiddesign.report.figures.drawing import inline_svg, svg_of, write_figure

PACKAGE = "rfiddesign.report"


@dataclass(frozen=True)
class Drawn:
    """A figure on a page."""

    name: str
    caption: str
    svg: Markup


def filled(template: str, **values: object) -> str:
    """A template with its values, every text among them escaped."""
    environment = Environment(
        loader=PackageLoader(PACKAGE, "."),
        autoescape=True,
        undefined=StrictUndefined,
        finalize=_with_tight_units,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    return environment.get_template(template).render(**values)


def style(*sheets: str) -> Markup:
    """Style sheets of the package, one after the other."""
    texts = (resources.files(PACKAGE).joinpath(sheet).read_text(encoding="utf-8") for sheet in sheets)
    return Markup("".join(texts))


def drawn_into(folder: Path, picture: Picture) -> Drawn:
    """Write a figure into a folder as SVG and PNG; the same for a page."""
    svg = svg_of(picture.figure, picture.name)
    write_figure(folder, picture.name, picture.figure, svg)
    return Drawn(picture.name, picture.caption, Markup(inline_svg(svg, picture.name, picture.caption)))


def _with_tight_units(text: object) -> object:
    """Keep a number and its unit on one line."""
    if not isinstance(text, str) or isinstance(text, Markup):
        return text
    return re.sub(r"(?<=\d) (?=%|mm\b|m²)", "\u00a0", text)
