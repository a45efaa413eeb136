"""Numbers that are not finite, or overflow on the way, never pass for a solution: the solvers' own error names them."""

import numpy as np
import pytest

from slipcore.contact.elasticity.grid import Grid
from slipcore.contact.elasticity.operator import Operators
from slipcore.contact.errors import NotConverged
from slipcore.contact.limit_load import limit_load
from slipcore.contact.solver.normal import solve_normal
from slipcore.contact.solver.projection import project
from slipcore.contact.solver.tangential import SolverControl, solve_tangential
from tests.slipcore.contact.solver.following import FRICTION, body, bowl

GRID = Grid.square(24, 10e-3)
X, Y = GRID.points()
LIMIT = 1e4 * np.sqrt(np.maximum(1.0 - (X**2 + Y**2) / 4e-3**2, 0.0))
SLIDING = float(LIMIT.sum()) * GRID.cell_area
CONTROLS = {
    "load": SolverControl(load=np.array([0.5 * SLIDING, 0.0, 0.0])),
    "motion": SolverControl(motion=np.array([1e-4, 0.0, 0.0]), given=np.zeros(3, dtype=bool)),
}


def solve(control: SolverControl, **fields: np.ndarray) -> None:
    """One step with some fields in place of those that can be solved."""
    nothing = np.zeros((2, *GRID.shape))
    given = {"x": X, "y": Y, "limit": LIMIT, "offset": nothing, "start": nothing} | fields
    points = given["x"], given["y"]
    operator = Operators((body(),)).on(GRID)
    solve_tangential(operator, points, given["limit"], given["offset"], control, given["start"], 1e-6)


@pytest.mark.parametrize("control", CONTROLS.values(), ids=CONTROLS)
@pytest.mark.parametrize("cell", [(12, 12), (0, 0), (23, 23)])
@pytest.mark.parametrize("name", ["offset", "start", "limit"])
def test_one_nan_in_a_field_is_an_error(name: str, cell: tuple[int, int], control: SolverControl) -> None:
    field = LIMIT.copy() if name == "limit" else np.zeros((2, *GRID.shape))
    field[(..., *cell) if name == "limit" else (1, *cell)] = np.nan
    with pytest.raises(NotConverged, match="residual nan"):
        solve(control, **{name: field})


@pytest.mark.parametrize("control", CONTROLS.values(), ids=CONTROLS)
@pytest.mark.parametrize("name", ["offset", "start"])
@pytest.mark.parametrize("value", [np.inf, -1e308, 1e160])
def test_fields_that_are_infinite_or_overflow_are_an_error(value: float, name: str, control: SolverControl) -> None:
    for cells in (np.s_[0, 12, 12], np.s_[:]):
        field = np.zeros((2, *GRID.shape))
        field[cells] = value
        with pytest.raises(NotConverged, match=r"residual (nan|inf)"):
            solve(control, **{name: field})


def test_a_load_on_the_limit_surface_does_not_hide_an_offset_that_is_not_finite() -> None:
    arm = np.stack((X.ravel(), Y.ravel()))
    force = limit_load(LIMIT.ravel(), arm, np.array([1.0, 0.0, 0.0]), np.ones(3, dtype=bool)).factor * GRID.cell_area
    offset = np.zeros((2, *GRID.shape))
    offset[0, 12, 12] = np.nan
    for share in (1.0, 1.0 + 1e-13):
        with pytest.raises(NotConverged, match="residual nan"):
            solve(SolverControl(load=share * np.array([force, 0.0, 0.0])), offset=offset)


def test_points_too_far_to_be_projected_have_no_traction() -> None:
    arm, given = np.stack((X.ravel(), Y.ravel())), np.zeros(3, dtype=bool)
    for value, known in ((1e140, True), (1e160, False), (np.inf, False), (np.nan, False)):
        point = np.zeros((2, LIMIT.size))
        point[0, 300] = value
        traction = project(point, FRICTION * LIMIT.ravel(), arm, np.zeros(3), given).traction
        assert np.isfinite(traction).all() == known
        if known:
            assert traction[0, 300] == pytest.approx(FRICTION * LIMIT.ravel()[300])


@pytest.mark.parametrize("value", [np.inf, 1e308])
@pytest.mark.parametrize("given", [{"force": 1.0}, {"approach": 5e-4}], ids=["force", "approach"])
def test_a_pressure_to_start_from_that_overflows_is_an_error(given: dict[str, float], value: float) -> None:
    with pytest.raises(NotConverged, match="residual nan"):
        solve_normal(Operators((body(),)), GRID, bowl(X, Y), start=np.full(GRID.shape, value), **given)
