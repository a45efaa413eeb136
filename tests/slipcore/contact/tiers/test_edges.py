"""Stress at the centres of cells along an edge, and areas within it, against closed forms."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy.special import ellipe, ellipk

from benchmarks.contact.accuracy import on_finer_cells
from benchmarks.contact.edge_cells import Spiral, cells_along_edge
from slipcore.contact import reference
from slipcore.contact.elasticity.bonded_layer import LayerBase
from slipcore.contact.elasticity.grid import Grid
from slipcore.contact.elasticity.influence import HalfSpace
from slipcore.contact.elasticity.operator import Operators
from slipcore.contact.reference.mindlin_deresiewicz import MindlinDeresiewicz
from slipcore.contact.reference.torsion import TorsionPartialSlip, sliding_moment
from slipcore.contact.solver.normal import solve_normal
from slipcore.contact.solver.problem import ContactProblem, StepLoad
from slipcore.contact.solver.quasi_static import QuasiStatic
from slipcore.contact.solver.state import StepResult
from slipcore.contact.tiers.edges import (
    BEYOND,
    EVEN,
    EXCESS,
    WITHIN,
    _from_tables,
    centre_field,
    centre_forces,
    shares_within_edge,
    weights_of,
)
from slipcore.errors import InvalidInput
from slipcore.frames import FloatArray

Surface = Callable[[FloatArray, FloatArray], FloatArray]
FORCE, FRICTION, RADIUS, YOUNG = 10.0, 0.4, 15e-3, 1e6
HERTZ = reference.HertzContact(RADIUS, FORCE, reference.half_space(YOUNG, 0.0))
WIDTHS = (2.11, 2.15, 2.24)
"""Of grids, in contact radii: others than those that the benchmark reports."""


def sphere(x: FloatArray, y: FloatArray) -> FloatArray:
    return np.asarray((x**2 + y**2) / (2.0 * RADIUS))


def pressure_on(grid: Grid, height: Surface, force: float) -> FloatArray:
    operators = Operators((HalfSpace.from_young(YOUNG, 0.0),))
    return solve_normal(operators, grid, height(*grid.points()), force=force, tolerance=1e-7).pressure


def off_centre(cells: int, width: float) -> Grid:
    """A grid of that width m that lies unevenly on the origin."""
    pitch = width / cells
    return Grid((cells, cells), (pitch, pitch), (0.13 * pitch, 0.29 * pitch))


def loaded(grid: Grid, loads: list[StepLoad], poisson: float = 0.0) -> list[StepResult]:
    problem = ContactProblem((HalfSpace.from_young(YOUNG, poisson),), FRICTION, heights=(sphere,))
    return list(QuasiStatic(problem, grid, 1e-7, 1e-9).run(loads))


def shear(share: float, moment: float = 0.0) -> StepLoad:
    return StepLoad(FORCE, tangential=np.array([share * FRICTION * FORCE, 0.0, moment]))


def relative(found: FloatArray, exact: FloatArray) -> float:
    return float(np.linalg.norm(found - exact) / np.linalg.norm(exact))


def steep(x: FloatArray, y: FloatArray) -> FloatArray:
    """A body of the fourth power of the distance."""
    return np.asarray((x**2 + y**2) ** 2)


def pressure_of_steep(x: FloatArray, y: FloatArray) -> FloatArray:
    """Its pressure, up to a factor, on a contact of radius 1 (Johnson, §5.3)."""
    r = x**2 + y**2
    return np.sqrt(np.maximum(1.0 - r, 0.0)) * (1.0 + 2.0 * r)


STEEP_FORCE = 1.6 * YOUNG * np.sqrt(np.pi) * 2.0 / (0.75 * np.sqrt(np.pi))
"""8/5 E* κ, κ = √π Γ(3)/Γ(5/2): what presses that body to a contact of radius 1."""


def test_the_pressure_of_a_sphere_gains_an_order() -> None:
    errors = {
        cells: np.mean(
            [
                [relative(at, exact) for at in (pressure, centre_field(pressure, pressure > 0.0))]
                for width in WIDTHS
                for grid in [off_centre(cells, width * HERTZ.contact_radius)]
                for pressure in [pressure_on(grid, sphere, FORCE)]
                for exact in [HERTZ.pressure(np.hypot(*grid.points()))]
            ],
            axis=0,
        )
        for cells in (20, 84)
    }
    plain, corrected = np.log(errors[20] / errors[84]) / np.log(84 / 20)
    assert plain < 1.2
    assert corrected > 1.6
    assert errors[84][1] < errors[84][0] / 12.0


@pytest.mark.parametrize(("cells", "most"), [(20, 1.6e-2), (84, 1.2e-3)])
def test_pressure_whose_square_bends_at_the_edge_is_met_too(cells: int, most: float) -> None:
    grid = off_centre(cells, 2.2)
    pressure, shape = pressure_on(grid, steep, STEEP_FORCE), pressure_of_steep(*grid.points())
    exact = shape * STEEP_FORCE / (2.0 * np.pi * 0.6)  # ∫ √(1 − r²)(1 + 2r²) r dr = 1/3 + 4/15
    found = centre_field(pressure, pressure > 0.0)
    assert relative(found, exact) < min(most, 0.5 * relative(pressure, exact))


def elliptic(width: float) -> tuple[Surface, Surface, float]:
    """Height, pressure and force of a contact of half-axes 1 and ``width``, pressure YOUNG at most (Johnson, §4.2)."""
    modulus = 1.0 - width**2
    first, second = ellipk(modulus), ellipe(modulus)
    along, across = width * (first - second) / modulus, width * (second / width**2 - first) / modulus
    return (
        lambda x, y: np.asarray(along * x**2 + across * y**2),
        lambda x, y: YOUNG * np.sqrt(np.maximum(1.0 - x**2 - (y / width) ** 2, 0.0)),
        2.0 / 3.0 * np.pi * width * YOUNG,
    )


def test_an_elliptic_contact_and_its_area_are_met() -> None:
    height, exact, force = elliptic(0.6)
    grid = off_centre(60, 2.2)
    pressure = pressure_on(grid, height, force)
    touches = pressure > 0.0
    right = exact(*grid.points())
    assert relative(centre_field(pressure, touches), right) < 0.2 * relative(pressure, right)
    area = shares_within_edge(pressure, touches).sum() * grid.cell_area
    assert area == pytest.approx(0.6 * np.pi, rel=5e-4)
    assert abs(touches.sum() * grid.cell_area / (0.6 * np.pi) - 1.0) > 1e-2


@pytest.mark.parametrize("share", [0.4, 0.75, 0.95])
def test_traction_in_partial_slip_is_met(share: float) -> None:
    grid = off_centre(60, 2.15 * HERTZ.contact_radius)
    results = loaded(grid, [shear(0.0), shear(share)])
    exact = reference.CattaneoMindlin(HERTZ, FRICTION, share * FRICTION * FORCE).traction(np.hypot(*grid.points()))
    found = list(centre_forces(results, 0.0))[-1][0] / grid.cell_area
    assert relative(found, exact) < 0.15 * relative(results[-1].force[0] / grid.cell_area, exact)


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.4999, 0.5])
def test_traction_in_torsion_is_met_at_any_poisson_s_ratio(poisson: float) -> None:
    hertz = reference.HertzContact(RADIUS, FORCE, reference.half_space(YOUNG, poisson))
    grid, moment = off_centre(60, 2.15 * hertz.contact_radius), 0.5 * sliding_moment(hertz, FRICTION)
    results = loaded(grid, [shear(0.0), shear(0.0, moment)], poisson)
    x, y = grid.points()
    r = np.hypot(x, y)
    exact = TorsionPartialSlip(hertz, FRICTION, moment).traction(r) / r * np.stack((-y, x))
    found = list(centre_forces(results, poisson))[-1][:2] / grid.cell_area
    assert relative(found, exact) < 0.2 * relative(results[-1].force[:2] / grid.cell_area, exact)


def test_what_earlier_edges_of_stick_left_stays_until_a_later_one_passes() -> None:
    grid = off_centre(60, 2.15 * HERTZ.contact_radius)
    shares = (0.0, 0.6, 0.2, -0.2, -0.6, 0.1, 0.7)
    results, exact = loaded(grid, [shear(share) for share in shares]), MindlinDeresiewicz(HERTZ, FRICTION)
    r, alone = np.hypot(*grid.points()), []
    for share, result, force in zip(shares, results, centre_forces(results, 0.0), strict=True):
        exact = exact.load(FORCE, share * FRICTION * FORCE)
        right = exact.traction(r)
        if share:
            error = relative(force[0] / grid.cell_area, right)
            assert error < 0.4 * relative(result.force[0] / grid.cell_area, right)
            alone.append(relative(next(centre_forces([result], 0.0))[0] / grid.cell_area, right) / error)
    assert max(alone) > 2.0, "steps before are needed"


def test_traction_that_sticks_all_over_ends_as_pressure_does() -> None:
    grid, loads = off_centre(60, 2.15 * HERTZ.contact_radius), [StepLoad(0.3 * FORCE), shear(0.24)]
    results = loaded(grid, loads)
    assert not results[-1].at_limit[results[-1].contact].any()
    before = reference.HertzContact(RADIUS, 0.3 * FORCE, reference.half_space(YOUNG, 0.0))
    r = np.hypot(*grid.points())
    exact = 0.24 / 0.7 * FRICTION * (HERTZ.pressure(r) - before.pressure(r))
    found = list(centre_forces(results, 0.0))[-1][0] / grid.cell_area
    assert relative(found, exact) < 0.8 * relative(results[-1].force[0] / grid.cell_area, exact)


def test_traction_of_a_contact_that_grew_while_all_stuck_keeps_what_smaller_ones_left() -> None:
    grid, paths = off_centre(60, 2.15 * HERTZ.contact_radius), ((0.3, 0.0), (0.3, 0.15), (0.6, 0.3), (1.0, 0.5))
    loads = [StepLoad(press * FORCE, tangential=np.array([pull * FRICTION * FORCE, 0.0, 0.0])) for press, pull in paths]
    results = loaded(grid, loads)
    exact = MindlinDeresiewicz(reference.HertzContact(RADIUS, 0.3 * FORCE, HERTZ.compliance), FRICTION)
    for press, pull in paths:
        exact = exact.load(press * FORCE, pull * FRICTION * FORCE)
    right = exact.traction(np.hypot(*grid.points()))
    found = list(centre_forces(results, 0.0))[-1][0] / grid.cell_area
    assert 0.3 < relative(found, right) / relative(results[-1].force[0] / grid.cell_area, right) < 0.9


def test_an_oblique_load_and_one_whose_pressing_falls_are_met_as_well() -> None:
    grid, along = off_centre(60, 2.15 * HERTZ.contact_radius), np.array([np.cos(4.0), np.sin(4.0), 0.0])
    paths, exact = ((1.0, 0.0), (1.0, 0.6), (0.7, 0.3), (0.4, 0.1)), MindlinDeresiewicz(HERTZ, FRICTION)
    results = loaded(
        grid, [StepLoad(press * FORCE, tangential=pull * FRICTION * FORCE * along) for press, pull in paths]
    )
    for (press, pull), result, force in zip(paths, results, centre_forces(results, 0.0), strict=True):
        exact = exact.load(press * FORCE, pull * FRICTION * FORCE)
        right = exact.traction(np.hypot(*grid.points())) * along[:2, None, None]
        if pull:
            error = relative(force[:2] / grid.cell_area, right)
            assert error < 0.2 * relative(result.force[:2] / grid.cell_area, right)


@pytest.mark.parametrize(("longer", "most"), [(1.25, 0.2), (2.0, 0.4), (3.0, 0.5)])
def test_longer_cells_gain_less(longer: float, most: float) -> None:
    pitch = 2.15 * HERTZ.contact_radius / 80
    grid = Grid((int(np.ceil(80 / longer)), 80), (pitch, longer * pitch), (0.13 * pitch, 0.29 * longer * pitch))
    pressure, exact = pressure_on(grid, sphere, FORCE), HERTZ.pressure(np.hypot(*grid.points()))
    assert relative(centre_field(pressure, pressure > 0.0), exact) < most * relative(pressure, exact)


def test_the_pressure_of_a_thin_layer_gains_as_that_of_a_half_space_does() -> None:
    def on(count: int) -> FloatArray:
        pitch = 2.3e-3 * 4 / count
        bodies = (HalfSpace.from_young(YOUNG, 0.45), LayerBase(2e-3, YOUNG, 0.45))
        grid = Grid((count, count), (pitch, pitch))
        return solve_normal(Operators(bodies), grid, sphere(*grid.points()), force=FORCE, tolerance=1e-7).pressure

    pressure, fine = on(49), on(5 * 49)
    exact = centre_field(fine, fine > 0.0)[2::5, 2::5]
    assert relative(centre_field(pressure, pressure > 0.0), exact) < 0.15 * relative(pressure, exact)


def test_parts_that_are_not_numbers_stay_what_they_are_and_arguments_are_not_changed() -> None:
    grid = off_centre(40, 2.15 * HERTZ.contact_radius)
    pressure = pressure_on(grid, sphere, FORCE)
    touches, broken = pressure > 0.0, pressure.copy()
    where = tuple(np.argwhere(touches)[0])
    broken[where] = np.nan
    given = broken.copy(), touches.copy()
    found = centre_field(broken, touches)
    assert np.argwhere(np.isnan(found)).tolist() == [list(where)]
    far = np.hypot(*(np.indices(grid.shape) - np.reshape(where, (2, 1, 1)))) > 12.0
    np.testing.assert_array_equal(found[far], centre_field(pressure, touches)[far])
    np.testing.assert_array_equal(broken, given[0])
    np.testing.assert_array_equal(touches, given[1])


@pytest.mark.parametrize("factor", [1e-6, 1e6])
def test_units_do_not_matter(factor: float) -> None:
    pressure = pressure_on(off_centre(40, 2.15 * HERTZ.contact_radius), sphere, FORCE)
    found = centre_field(factor * pressure, pressure > 0.0)
    np.testing.assert_allclose(found, factor * centre_field(pressure, pressure > 0.0), rtol=1e-9)


@pytest.mark.parametrize("cells", [5, 9, 17, 40])
def test_fields_that_do_not_end_with_a_root_stay(cells: int) -> None:
    grid = off_centre(cells, 2.2)

    def punch(x: FloatArray, y: FloatArray) -> FloatArray:
        return np.where(x**2 + y**2 < 0.8, 0.0, np.inf)

    pressure = pressure_on(grid, punch, 1e6)
    touches = pressure > 0.0
    np.testing.assert_allclose(centre_field(pressure, touches), pressure, rtol=0.02)
    assert shares_within_edge(pressure, touches).sum() == pytest.approx(touches.sum(), rel=0.02)


def test_the_area_within_a_field_that_ends_abruptly_is_that_of_its_cells() -> None:
    x, y = Grid.square(24, 2.4).points()
    inside = x**2 + y**2 < 0.9
    field = np.where(inside, 4.0 - x**2 - y**2, 0.0)
    assert shares_within_edge(field, inside).sum() == pytest.approx(inside.sum(), rel=5e-3)


def test_a_contact_cut_by_the_grid_stays_there() -> None:
    grid = off_centre(20, 1.4 * HERTZ.contact_radius)
    pressure = pressure_on(grid, sphere, FORCE)
    rim = np.pad(np.zeros((18, 18), dtype=bool), 1, constant_values=True)
    found = centre_field(pressure, pressure > 0.0)
    np.testing.assert_allclose(found[rim], pressure[rim], rtol=0.02)


@pytest.mark.parametrize("cells", [3, 4, 5])
def test_few_cells_become_no_worse(cells: int) -> None:
    grid = off_centre(cells, 2.15 * HERTZ.contact_radius)
    pressure, exact = pressure_on(grid, sphere, FORCE), HERTZ.pressure(np.hypot(*grid.points()))
    found = centre_field(pressure, pressure > 0.0)
    assert np.isfinite(found).all()
    assert relative(found, exact) <= 1.05 * relative(pressure, exact)


def test_nothing_is_made_of_no_contact_of_lone_cells_or_of_even_ones() -> None:
    lone = np.zeros((5, 6), dtype=bool)
    np.testing.assert_array_equal(centre_field(lone * 1.0, lone), 0.0)
    lone[2, 3] = lone[0, 0] = True
    np.testing.assert_array_equal(centre_field(lone * 2.0, lone), lone * 2.0)
    even = np.ones((8, 8), dtype=bool)
    np.testing.assert_array_equal(centre_field(even * 2.0, even), 2.0)
    np.testing.assert_array_equal(shares_within_edge(even * 2.0, even), even)


def test_both_sides_of_a_ring_are_corrected() -> None:
    def errors(cells: int) -> tuple[float, float]:
        def on(count: int) -> FloatArray:
            pitch = 2.6e-3 * 4 / count
            grid = Grid((count, count), (pitch, pitch))
            return pressure_on(grid, lambda x, y: (np.hypot(x, y) - 3e-3) ** 2 / 6e-3, 5.0)

        pressure, fine = on(cells), on(5 * cells)
        exact = centre_field(fine, fine > 0.0)[2::5, 2::5]
        return relative(pressure, exact), relative(centre_field(pressure, pressure > 0.0), exact)

    plain, corrected = errors(48)
    assert corrected < 0.5 * plain


def test_the_table_is_that_of_a_sphere_on_a_finer_grid() -> None:
    grid = off_centre(190, 2.13 * HERTZ.contact_radius)
    x, y = grid.points()
    share, reach = (x**2 + y**2) / HERTZ.contact_radius**2, HERTZ.contact_radius / grid.pitch[0]
    pressure, slope = pressure_on(grid, sphere, FORCE), 2.0 * np.sqrt(share) / reach
    seems, lies = (pressure / HERTZ.peak_pressure) ** 2 / slope, (1.0 - share) / slope
    near = (pressure > 0.0) & (seems < 8.0)
    left = (seems - lies)[near]
    found = _from_tables(EVEN, seems[near], np.stack((x[near], y[near])))[0]
    assert np.sqrt(np.mean(left**2)) > 0.015
    assert np.sqrt(np.mean((left - found) ** 2)) < 0.002


def test_the_tables_are_those_of_other_slip_and_anisotropy_on_another_grid() -> None:
    cells = cells_along_edge(Spiral(off_centre(190, 2.29), np.radians(31.0), 0.27))
    for which, distance, chosen, values, least in (
        (EXCESS, cells.seems, cells.within, cells.seems - cells.lies, 0.015),
        (WITHIN, cells.seems, cells.within, cells.across, 0.005),
        (BEYOND, cells.lies, ~cells.within, cells.across, 0.004),
    ):
        steep = np.stack((np.cos(cells.angle), np.sin(cells.angle)))[:, chosen]
        weights = cells.weights[:, chosen] if which is EXCESS else cells.weights[1:, chosen]
        left = values[chosen] - (weights * _from_tables(which, distance[chosen], steep)).sum(axis=0)
        assert np.sqrt(np.mean(values[chosen] ** 2)) > least
        assert np.sqrt(np.mean(left**2)) < 0.12 * np.sqrt(np.mean(values[chosen] ** 2))


def test_a_mirror_turns_what_is_across_slip_and_a_quarter_turn_does_not() -> None:
    generator = np.random.default_rng(3)
    slope, slip = generator.normal(size=(2, 50)), generator.normal(size=(2, 50))
    slip /= np.hypot(*slip)
    weights, turned = weights_of(slope, slip, 0.2)
    for moved, sign in (
        (lambda part: part * np.array([[-1.0], [1.0]]), -1.0),
        (lambda part: part[::-1], -1.0),
        (lambda part: part[::-1] * np.array([[-1.0], [1.0]]), 1.0),
    ):
        others, side = weights_of(moved(slope), moved(slip), 0.2)
        np.testing.assert_allclose(others, weights, atol=1e-12)
        np.testing.assert_array_equal(side, sign * turned)
    np.testing.assert_allclose(weights_of(slope, -slip, 0.2)[0], weights, atol=1e-12)


@pytest.mark.parametrize("poisson", [0.3, pytest.param(0.4999, marks=pytest.mark.long)])
def test_traction_in_partial_slip_without_a_closed_form_gains_an_order(poisson: float) -> None:
    def errors(cells: int) -> list[float]:
        grid = off_centre(cells, 2.15 * HERTZ.contact_radius)
        results = loaded(grid, [shear(0.0), shear(0.6)], poisson)
        exact = on_finer_cells(grid, (0.6,), poisson)[-1]
        found = (results[-1].force, list(centre_forces(results, poisson))[-1])
        return [relative(force[:2] / grid.cell_area, exact) for force in found]

    coarse, fine = np.array(errors(24)), np.array(errors(72))
    plain, corrected = np.log(coarse / fine) / np.log(3.0)
    assert plain < 1.2
    assert corrected > 1.4
    assert fine[1] < 0.12 * fine[0]


def test_that_bodies_are_anisotropic_does_not_matter_without_slip_or_without_stick() -> None:
    grid = off_centre(40, 2.15 * HERTZ.contact_radius)
    for dragged in (0.0, 1e-2):
        drag = StepLoad(FORCE, motion=np.array([dragged, 0.0, 0.0]), given=(False, False, False))
        results = loaded(grid, [StepLoad(0.5 * FORCE), shear(0.0), drag], 0.45)
        assert results[-1].at_limit[results[-1].contact].any() == results[-1].sliding == (dragged > 0.0)
        for even, uneven in zip(centre_forces(results, 0.0), centre_forces(results, 0.45), strict=True):
            np.testing.assert_array_equal(even, uneven)


def test_edges_of_stick_within_a_cell_of_each_other_become_no_worse() -> None:
    shares, grid = (0.6, 0.2, 0.55), off_centre(32, 2.15 * HERTZ.contact_radius)
    results = loaded(grid, [shear(0.0), *(shear(share) for share in shares)], 0.45)
    right = on_finer_cells(grid, shares)
    for result, force, exact in zip(results, centre_forces(results, 0.45), right, strict=True):
        plain = np.linalg.norm(result.force[:2] / grid.cell_area - exact)
        assert np.linalg.norm(force[:2] / grid.cell_area - exact) <= 1.02 * plain


def test_an_edge_of_stick_with_a_corner_becomes_no_worse() -> None:
    def slippery_quarter(x: FloatArray, y: FloatArray) -> FloatArray:
        return np.where((x > 0.0) & (y > 0.0), -0.3, 0.0)

    def on(count: int) -> tuple[Grid, list[StepResult]]:
        pitch = 2.1 * HERTZ.contact_radius / count
        bodies, heights = (HalfSpace.from_young(YOUNG, 0.45),), (sphere,)
        problem = ContactProblem(bodies, FRICTION, heights=heights, friction_fields=(slippery_quarter,))
        grid = Grid((count, count), (pitch, pitch))
        return grid, list(QuasiStatic(problem, grid, 1e-7, 1e-9).run([shear(0.0), shear(0.4)]))

    (grid, results), (finer, fine) = on(24), on(5 * 24)
    exact = fine[-1].force[:2, 2::5, 2::5] / finer.cell_area
    found = list(centre_forces(results, 0.45))[-1][:2] / grid.cell_area
    assert relative(found, exact) < relative(results[-1].force[:2] / grid.cell_area, exact)


def test_traction_of_a_contact_that_a_corner_of_the_grid_cuts_stays_there() -> None:
    pitch = HERTZ.contact_radius / 20
    grid = Grid((24, 24), (pitch, pitch), (8.0 * pitch, 8.0 * pitch))
    results = loaded(grid, [shear(0.0), shear(0.3)], 0.45)
    plain, found = results[-1].force, list(centre_forces(results, 0.45))[-1]
    cut = np.zeros(grid.shape, dtype=bool)
    cut[0, :12] = cut[:12, 0] = True
    assert results[-1].contact[cut].all()
    np.testing.assert_allclose(found[:, cut], plain[:, cut], rtol=0.03, atol=0.03 * np.abs(plain[:2]).max())


@pytest.mark.parametrize("poisson", [-0.1, 0.6, np.nan])
def test_ratios_that_no_body_has_are_refused(poisson: float) -> None:
    with pytest.raises(InvalidInput, match="Poisson's ratio"):
        next(centre_forces([], poisson))
