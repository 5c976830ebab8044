"""Figures as files and as parts of a page, the same bytes each time."""

import io
import re
from pathlib import Path

from matplotlib.figure import Figure

from rfiddesign.report.figures.style import in_style
from rfiddesign.results.folder import replacing, write_text

PNG_DPI = 200
#: Heavy parts of a figure are pixels in its SVG, at this many per inch: twice what a screen shows.
RASTER_DPI = 200


def svg_of(figure: Figure, name: str) -> str:
    """The figure as a complete SVG file; `name` keeps its ids apart from those of other figures."""
    buffer = io.StringIO()
    with in_style(**{"svg.hashsalt": name}):
        figure.savefig(buffer, format="svg", dpi=RASTER_DPI, metadata={"Date": None, "Creator": None})
    # Laying out is a third of the work; the places found hold for every other format.
    figure.set_layout_engine("none")
    return re.sub(r"[ \t]+$", "", buffer.getvalue(), flags=re.MULTILINE)


def inline_svg(svg: str, name: str, words: str) -> str:
    """The SVG element alone, for a page: its ids begin with `name`, and `words` say what it shows.

    Without XML header and metadata, whose addresses a page has no use for.
    """
    element = svg[svg.index("<svg") :].strip()
    element = re.sub(r"\s*<metadata>.*?</metadata>", "", element, flags=re.DOTALL)
    element = re.sub(r'\bid="', f'id="{name}--', element)
    element = re.sub(r'href="#', f'href="#{name}--', element)
    element = re.sub(r"url\(#", f"url(#{name}--", element)
    label = words.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;").replace('"', "&quot;")
    return element.replace("<svg ", f'<svg role="img" aria-label="{label}" ', 1)


def write_figure(folder: Path, name: str, figure: Figure, svg: str) -> None:
    """Write a figure as name.svg and name.png."""
    write_text(folder / f"{name}.svg", svg)
    with replacing(folder / f"{name}.png") as temporary, in_style():
        figure.savefig(temporary, format="png", dpi=PNG_DPI, metadata={"Software": None})
