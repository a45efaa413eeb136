from pathlib import Path

import pytest
from matplotlib.figure import Figure

from service.report.page import Fact, Picture, Report, Section, Table, render, write_report
from tests.service.web.conftest import HOSTILE, Elements


def report(typed: str, folded: bool = False) -> Report:
    figure = Figure()
    figure.subplots().plot([0.0, 1.0], color="#57606a")
    table = Table(typed, (typed,), [[typed]])
    section = Section(typed, typed, [table], [Picture(typed[:100], figure)], folded)
    return Report(typed, typed, [Fact(typed, typed)], [typed], [section])


@pytest.mark.parametrize("typed", HOSTILE)
def test_what_somebody_typed_is_text_and_never_markup(typed: str) -> None:
    page = Elements(render(report(typed)))
    assert page.text.count(typed) >= 9
    assert {tag for tag, _ in page.found if tag in {"script", "img", "iframe", "object"}} == set()
    assert [name for _, given in page.found for name in given if name.startswith("on")] == []


def test_a_report_is_whole_in_one_file_that_may_load_nothing(tmp_path: Path) -> None:
    path = write_report(report("a grasp"), tmp_path / "new" / "report.html")
    assert [each.name for each in path.parent.iterdir()] == ["report.html"]
    page = Elements(path.read_text(encoding="utf-8"))
    addresses = [
        given[name] or "" for _, given in page.found for name in ("src", "href", "xlink:href") if name in given
    ]
    assert [address for address in addresses if not address.startswith(("#", "data:"))] == []
    (policy,) = [given["content"] for _, given in page.found if given.get("http-equiv") == "Content-Security-Policy"]
    assert policy == "default-src 'none'; style-src 'unsafe-inline'; img-src data:"


def test_a_folded_section_shows_its_heading_until_it_is_opened() -> None:
    assert "<details><summary><h2>grasps</h2>" in render(report("grasps", folded=True))
    assert "<details>" not in render(report("grasps"))


def test_lines_and_text_of_a_picture_have_the_colours_of_the_page() -> None:
    page = render(report("colours"))
    svg = page[page.index("<svg") : page.index("</svg>")]
    assert "stroke: var(--faint)" in svg  # the line
    assert "stroke: var(--text)" in svg  # the frame
    assert "#000000" not in svg
    assert "#57606a" not in svg


def test_two_pictures_on_a_page_share_no_id() -> None:
    section = report("one").sections[0]
    two = Report("two", "", sections=[section, *report("another").sections])
    ids = [given["id"] for _, given in Elements(render(two)).found if "id" in given]
    assert ids
    assert len(ids) == len(set(ids))
