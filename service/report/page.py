"""A report as one HTML file: a summary, what to do next, and details; style and pictures are inside of it."""

import io
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from service.formatting import moment
from service.report.colours import OF_THE_PAGE
from service.whole_files import write_whole

if TYPE_CHECKING:
    from matplotlib.figure import Figure

POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:"
"""What the page may load: nothing but what stands in it, and no scripts."""


@dataclass(frozen=True, slots=True)
class Fact:
    """A number of the summary with its name."""

    name: str
    value: str


@dataclass(frozen=True, slots=True)
class Table:
    """A table with a caption; the first column names the row."""

    caption: str
    columns: Sequence[str]
    rows: Sequence[Sequence[str]]


@dataclass(frozen=True, slots=True)
class Picture:
    """A figure with its caption."""

    caption: str
    figure: "Figure"


@dataclass(frozen=True, slots=True)
class Section:
    """A heading, a few sentences, tables and pictures; folded, only its heading is seen until somebody opens it."""

    heading: str
    text: str = ""
    tables: Sequence[Table] = ()
    pictures: Sequence[Picture] = ()
    folded: bool = False


@dataclass(frozen=True, slots=True)
class Report:
    """A title, what was found in a sentence and in ``facts``, what to do next (``steps``), and the ``sections``."""

    title: str
    lead: str
    facts: Sequence[Fact] = ()
    steps: Sequence[str] = ()
    sections: Sequence[Section] = ()

    @property
    def pictures(self) -> Iterator[Picture]:
        """Of all sections."""
        return (picture for section in self.sections for picture in section.pictures)


def write_report(report: Report, path: Path) -> Path:
    """Write a report to ``path``, as a whole or not at all, making its folder if need be, and return the path."""
    return write_whole(path, lambda beside: beside.write_text(render(report), encoding="utf-8"))


def render(report: Report) -> str:
    """A report as HTML; whatever somebody typed is escaped."""
    style = (files("service.web") / "static" / "style.css").read_text(encoding="utf-8")
    made = moment(datetime.now(UTC))
    return (
        _environment().get_template("report.html").render(report=report, style=Markup(style), policy=POLICY, made=made)
    )


def inline_svg(picture: Picture) -> Markup:
    """A picture as SVG that may stand in a page, in whose colours it is drawn; ids that nothing refers to are left out,
    for two pictures share them.
    """
    from matplotlib import rc_context

    buffer = io.StringIO()
    with rc_context({"svg.fonttype": "none", "svg.hashsalt": picture.caption}):
        picture.figure.savefig(buffer, format="svg", dpi=150, bbox_inches="tight", transparent=True)
    text = buffer.getvalue()
    svg = re.sub(r"<metadata>.*?</metadata>", "", text[text.index("<svg") :], flags=re.DOTALL)
    known = set(re.findall(r"[#](\w+)", svg))
    svg = re.sub(r' id="([^"]*)"', lambda found: found[0] if found[1] in known else "", svg)
    for colour, variable in OF_THE_PAGE.items():
        svg = svg.replace(colour, variable)
    return Markup(re.sub(r' (?:width|height)="[\d.]+pt"', "", svg, count=2))


@cache
def _environment() -> Environment:
    environment = Environment(
        loader=PackageLoader("service", "templates"), autoescape=True, undefined=StrictUndefined, trim_blocks=True
    )
    environment.filters["inline_svg"] = inline_svg
    return environment
