"""The HTML report of a demo run: tables and pictures on one page that reads well on a phone too."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined


@dataclass(frozen=True, slots=True)
class Table:
    """A table with a caption; the first column names the row."""

    caption: str
    columns: Sequence[str]
    rows: Sequence[Sequence[str]]


@dataclass(frozen=True, slots=True)
class Picture:
    """A picture beside the page, with its caption."""

    caption: str
    path: Path


@dataclass(frozen=True, slots=True)
class Section:
    """A heading, a few sentences, tables and pictures."""

    heading: str
    text: str
    tables: Sequence[Table] = ()
    pictures: Sequence[Picture] = ()


def write_report(title: str, lead: str, sections: Sequence[Section], folder: Path) -> Path:
    """Write ``report.html`` into ``folder``, linking the pictures relative to it, and return its path."""
    environment = Environment(
        loader=PackageLoader("service", "templates"), autoescape=True, undefined=StrictUndefined, trim_blocks=True
    )
    context: Mapping[str, object] = {"title": title, "lead": lead, "sections": sections, "folder": folder}
    page = folder / "report.html"
    page.write_text(environment.get_template("report.html").render(context), encoding="utf-8")
    return page
