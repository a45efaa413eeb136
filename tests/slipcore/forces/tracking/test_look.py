"""What is looked for in a stream's frames, by what is known of the sensor and its contact."""

from functools import partial
from types import SimpleNamespace
from typing import Any

import pytest

from slipcore.forces.defaults import FORCE_STREAM
from slipcore.forces.tracking.look import ContactTracking

FLAT: Any = SimpleNamespace(sees_depth=False)
TRACKER: Any = SimpleNamespace()


def next_of(size: float, tracker: Any = TRACKER, touched: bool = True) -> str | None:
    """What is found out next, by name, of a frame whose markers move by ``size`` after one in which they did by 1 m."""
    frame: Any = SimpleNamespace(size=size)
    found = ContactTracking(FLAT, tracker=tracker, size=1.0).next_look(frame, touched)
    assert found is None or isinstance(found, partial)
    return None if found is None else found.func.__name__


def test_a_contact_is_begun_followed_and_left_alone_while_it_holds(monkeypatch: pytest.MonkeyPatch) -> None:
    holds = True
    monkeypatch.setattr(ContactTracking, "holds", lambda *_: holds)
    assert next_of(1.0, tracker=None) == "_begin"
    assert next_of(1.0) is None
    assert next_of(1.01 * FORCE_STREAM.growth_in_plane) == "_begin"
    holds = False
    assert next_of(1.0) == "_follow"
    assert next_of(1.0, touched=False) is None
