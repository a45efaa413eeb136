"""Scenes of an independent boundary-element solver; its README says how they were made."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from slipcore.contact.elasticity.bonded_layer import LayerBase
from slipcore.contact.elasticity.grid import Grid
from slipcore.contact.elasticity.influence import HalfSpace
from slipcore.contact.solver import quasi_static
from slipcore.contact.solver.problem import ContactProblem, HeightField, StepLoad
from slipcore.contact.solver.quasi_static import QuasiStatic
from slipcore.contact.solver.state import StepResult

SCENES = Path(__file__).parents[3] / "data" / "contact"
YOUNG, FRICTION = 1e6, 0.4
GRID = Grid.square(64, 16e-3)


def ball(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return (x**2 + y**2) / (2.0 * 15e-3)


def ring(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return (np.hypot(x, y) - 4e-3) ** 2 / (2.0 * 2e-3)


HEIGHTS: dict[str, tuple[HeightField, ...]] = {"ring": (ball, ring)}


def finger(poisson: float) -> HalfSpace:
    return HalfSpace.from_young(YOUNG, poisson)


def members(path: Path) -> dict[str, np.ndarray]:
    with np.load(path) as archive:
        return dict(archive)


def run(scene: Any, problem: ContactProblem, tolerance: float) -> list[StepResult]:
    """Results at the steps that the scene keeps."""
    columns = (scene["F_N"], scene["F_T"], 1e-3 * scene["M"])
    loads = [StepLoad(n, tangential=np.array([t, 0.0, m])) for n, t, m in zip(*columns, strict=True)]
    results = list(QuasiStatic(problem, GRID, tolerance).run(loads))
    return [results[k] for k in scene["step"]]


def points(scene: Any) -> tuple[np.ndarray, np.ndarray]:
    rows = [int(np.argmin(abs(GRID.y - 1e-3 * y))) for y in scene["y"]]
    columns = [int(np.argmin(abs(GRID.x - 1e-3 * x))) for x in scene["x"]]
    return np.ix_(rows, columns)


@pytest.mark.parametrize("name", ["cond1", "cond4", "reversal", "ring"])
def test_displacements_and_all_masks_are_met(name: str) -> None:
    scene = members(SCENES / f"{name}.npz")
    problem = ContactProblem((finger(float(scene["nu"])),), FRICTION, heights=HEIGHTS.get(name, (ball,)))
    at, largest = points(scene), 1e-3 * np.abs(scene["u"]).max()
    for k, result in enumerate(run(scene, problem, 1e-5)):
        expected = 1e-3 * np.moveaxis(scene["u"][k], -1, 0)
        # single precision in the file
        np.testing.assert_allclose(result.displacement[:, *at], expected, rtol=0.0, atol=1e-5 * largest)
        np.testing.assert_array_equal(result.contact[at], scene["contact"][k])
        np.testing.assert_array_equal(result.at_limit[at], scene["slip_contact_factor"][k])
        np.testing.assert_array_equal(result.moved[at], scene["slip_kinematic"][k])
        assert result.stick_ratio == pytest.approx(scene["stick_ratio"][k], abs=1e-3, nan_ok=True)


def test_a_bonded_layer_with_coupling_is_met(monkeypatch: pytest.MonkeyPatch) -> None:
    """By the rule that the scene was made with: cells that touch in a step are charged their motion before."""
    monkeypatch.setattr(
        quasi_static, "from_touch", lambda equations, _, guess: (equations, guess, 0.0 * equations.offset)
    )
    scene = members(SCENES / "cond1_layer5c.npz")
    poisson = float(scene["nu"])
    bodies = (finger(poisson), LayerBase(5e-3, YOUNG, poisson))
    problem = ContactProblem(bodies, FRICTION, heights=(ball,), coupled=True)
    at, largest = points(scene), 1e-3 * np.abs(scene["u"]).max()
    for k, result in enumerate(run(scene, problem, 1e-4)):
        expected = 1e-3 * np.moveaxis(scene["u"][k], -1, 0)
        # 1.2e-4 at a tolerance of 1e-5, smooth over the contact: what a transform over a finite box leaves in the scene
        np.testing.assert_allclose(result.displacement[:, *at], expected, rtol=0.0, atol=2e-4 * largest)
        np.testing.assert_array_equal(result.contact[at], scene["contact"][k])
        assert result.stick_ratio == pytest.approx(scene["stick_ratio"][k], abs=0.015, nan_ok=True)  # four cells
