"""The graph behind the picture of ARCHITECTURE.md."""

from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from benchmarks import architecture
from benchmarks.architecture import circles, draw, heights, rooms

TOWER = {"roof": {"wall", "floor"}, "wall": {"floor"}, "floor": set[str]()}


@pytest.fixture(scope="module", autouse=True)
def parsed_once() -> Iterator[None]:
    """All modules take a second to parse."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(architecture, "imports", cache(architecture.imports))
        yield


def test_each_room_stands_above_what_it_imports() -> None:
    assert heights(TOWER) == {"floor": 0, "wall": 1, "roof": 2}


def test_an_import_that_leads_back_is_found() -> None:
    assert circles(TOWER) == set()
    assert circles(TOWER | {"floor": {"wall"}}) == {("wall", "floor"), ("floor", "wall")}


def test_no_rooms_import_one_another_in_a_circle() -> None:
    assert circles(rooms()) == set()


def test_names_that_a_package_passes_on_count_where_they_are_made() -> None:
    graph = architecture.imports()
    assert "slipcore.samples" in graph["service.jobs.fit_material"]
    assert "slipcore" not in graph


def test_the_picture_is_drawn(tmp_path: Path) -> None:
    draw(tmp_path / "rooms.png")
    assert (tmp_path / "rooms.png").stat().st_size > 10_000


def test_numerics_know_nothing_of_the_service() -> None:
    graph = rooms()
    low = {room for room in graph if room.startswith(("slipcore", "estimators", "db", "stiction_client"))}
    assert not {other for room in low for other in graph[room] if other.startswith("service")}
