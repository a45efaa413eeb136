"""Friction that pages show of a stored model, where no normal force is asked for."""

from types import SimpleNamespace
from typing import Any

import pytest

from service.web.friction import middle_force


def test_friction_is_shown_in_the_middle_of_the_forces_of_the_samples() -> None:
    stored: Any = SimpleNamespace(model=SimpleNamespace(normal_force=(0.02, 0.12)))
    assert middle_force(stored) == pytest.approx(0.07, rel=1e-12, abs=0.0)
