"""Looks for a contact where depth is seen, too: what is prepared before a touch, and how long it serves."""

from dataclasses import replace
from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from slipcore.forces.defaults import FORCE_STREAM
from slipcore.forces.operator.nodes import Nodes
from slipcore.forces.tracking import look
from slipcore.forces.tracking.known import KnownForce
from slipcore.forces.tracking.look import ContactTracking, MarkerReading, Prepared, bytes_needed

DEEP: Any = SimpleNamespace(sees_depth=True)
TRACKER: Any = SimpleNamespace()
LATTICE: Any = SimpleNamespace()


def reading(size: float, noise: float = 1e-6) -> MarkerReading:
    """Of two coordinates, one of which moves, and three of a force that is not known."""
    data = np.array([size * np.sqrt(2.0), 0.0, 7.0, 7.0, 7.0])
    return MarkerReading(0.5, data, np.ones(2, bool), noise, KnownForce.of(None, None, 1)[0])


def test_a_reading_is_as_large_as_its_markers_move_and_not_its_force() -> None:
    assert reading(3e-6).size == pytest.approx(3e-6, rel=1e-12)
    np.testing.assert_array_equal(reading(1.0).moved, [np.sqrt(2.0), 0.0])


@pytest.mark.parametrize(("told", "typical"), [(1e-7, 30e-6), (2e-4, 2e-4)])
def test_what_is_prepared_expects_no_less_than_a_usual_press(
    told: float, typical: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[tuple[float, float]] = []
    monkeypatch.setattr(look, "lattice_of", lambda _, *sizes: asked.append(sizes) or LATTICE)
    found = Prepared.of(DEEP, 1e-6, told)
    assert FORCE_STREAM.typical == 30.0
    assert (found.noise, found.typical) == (1e-6, pytest.approx(typical, rel=1e-12))
    assert asked == [(1e-6, found.typical)]
    assert found.lattice is LATTICE


@pytest.mark.parametrize(
    ("frame", "fits"),
    [
        (reading(1e-5), True),
        (reading(1e-5, 1.99e-6), True),
        (reading(1e-5, 2.01e-6), False),
        (reading(1e-5, 0.51e-6), True),
        (reading(1e-5, 0.49e-6), False),
        (reading(2.99e-4), True),
        (reading(3.01e-4), False),
    ],
)
def test_what_is_prepared_serves_while_noise_and_motion_are_alike(frame: MarkerReading, fits: bool) -> None:
    """Noise of 1 µm that no more than doubles or halves, motion of 30 µm that grows tenfold at most."""
    assert Prepared(LATTICE, 1e-6, 3e-5).fits(frame) == fits


def name_of(found: Any) -> str | None:
    assert found is None or isinstance(found, partial)
    return None if found is None else found.func.__name__


def test_where_depth_is_seen_all_is_prepared_first_and_anew_once_it_serves_no_more(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(ContactTracking, "holds", lambda *_: False)
    fresh = ContactTracking(DEEP)
    assert not fresh.is_ready
    assert [name_of(fresh.next_look(reading(1e-5), touched)) for touched in (False, True)] == ["_prepare"] * 2
    ready = replace(fresh, prepared=Prepared(LATTICE, 1e-6, 3e-5))
    assert ready.is_ready
    assert name_of(ready.next_look(reading(1e-5), False)) is None
    assert name_of(ready.next_look(reading(1e-5), True)) == "_begin"
    assert name_of(ready.next_look(reading(1e-5, 5e-6), False)) == "_prepare"
    followed = replace(ready, tracker=TRACKER, size=1e-5)
    assert name_of(followed.next_look(reading(0.99 * FORCE_STREAM.growth * 1e-5), True)) == "_follow"
    assert name_of(followed.next_look(reading(1.01 * FORCE_STREAM.growth * 1e-5), True)) == "_begin"
    assert FORCE_STREAM.growth < FORCE_STREAM.growth_in_plane


def test_in_the_plane_nothing_is_prepared() -> None:
    flat: Any = SimpleNamespace(sees_depth=False)
    assert ContactTracking(flat).is_ready


def test_what_is_no_longer_touched_keeps_its_sensor_and_what_was_prepared_alone() -> None:
    prepared = Prepared(LATTICE, 1e-6, 3e-5)
    left = ContactTracking(DEEP, prepared, TRACKER, TRACKER, 3.0, 1e-4).untouched()
    assert left.sensor is DEEP
    assert left.prepared is prepared
    assert (left.tracker, left.reader, left.time, left.size) == (None, None, 0.0, 0.0)


def test_a_contact_without_a_tracker_holds_in_no_frame() -> None:
    assert not ContactTracking(DEEP).holds(reading(1e-5))


@pytest.mark.parametrize("side", [2, 5])
def test_bytes_are_counted_by_markers_and_nodes(side: int) -> None:
    """Of doubles: 18 of each marker and one more with each node, and 2 and 3 for each of their pairs."""
    axis = 1e-3 * np.arange(float(side))
    place = np.stack([*np.meshgrid(axis, axis, indexing="ij"), np.zeros((side, side))], axis=-1)
    nodes = len(Nodes.around(place[..., :2].reshape(-1, 2), 1e-6))
    assert bytes_needed(place, 1e-6) == 8 * nodes * (18 * (side**2 + 1) + 5 * side**2)
