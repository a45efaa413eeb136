"""Kernels of a bonded layer against its compliance in wave number, thin and thick limits."""

import numpy as np
import pytest
from scipy import integrate, special

from slipcore.contact.elasticity.bonded_layer import LayerBase, _points, radial_functions
from slipcore.contact.elasticity.grid import Grid
from slipcore.contact.elasticity.influence import Component, HalfSpace
from slipcore.contact.elasticity.operator import Operators
from slipcore.contact.reference.bonded_layer import half_space_modes
from slipcore.contact.solver.normal import solve_normal
from slipcore.contact.solver.problem import ContactProblem, StepLoad
from slipcore.contact.solver.quasi_static import QuasiStatic

YOUNG, RADIUS, FRICTION = 1e6, 15e-3, 0.4
COMPONENTS: tuple[Component, ...] = ("nn", "xx", "xy", "yy", "zx", "zy")


def bodies(thickness: float, poisson: float) -> tuple[HalfSpace, LayerBase]:
    return HalfSpace.from_young(YOUNG, poisson), LayerBase(thickness, YOUNG, poisson)


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.49, 0.5])
def test_kernels_are_the_inverse_transform_of_the_compliance(poisson: float) -> None:
    """A Gaussian load of width w: its spectrum is a Gaussian too, and sums over a lattice finer than w are exact."""
    base, w = LayerBase(2e-3, YOUNG, poisson), 1e-3
    layer = base.layer()
    pitch = 0.37 * w
    x, y = np.meshgrid((np.arange(-16, 16) + 0.5) * pitch, (np.arange(-16, 16) + 0.5) * pitch)
    load = np.exp(-(x**2 + y**2) / (2 * w**2)) * pitch**2
    seen_x, seen_y = 1.5e-3, 0.7e-3
    r, angle = np.hypot(seen_x, seen_y), np.arctan2(seen_y, seen_x)

    def wave(order: int, mode) -> float:  # ∫ ΔC(k) p̂(k) J(kr) k dk / 2π
        def integrand(k: float) -> float:
            free = half_space_modes(k, layer.surface)
            return mode(layer.modes(k), free) * w**2 * np.exp(-0.5 * (k * w) ** 2) * special.jv(order, k * r) * k

        return integrate.quad(integrand, 0.0, 9.0 / w, epsabs=0.0, epsrel=1e-11, limit=200)[0]

    mean = wave(0, lambda a, b: 0.5 * (a.longitudinal + a.transverse - b.longitudinal - b.transverse))
    turning = wave(2, lambda a, b: 0.5 * (a.longitudinal - a.transverse - b.longitudinal + b.transverse))
    coupling = wave(1, lambda a, b: a.coupling - b.coupling)
    exact = {
        "nn": wave(0, lambda a, b: a.normal - b.normal),
        "xx": mean - turning * np.cos(2 * angle),
        "yy": mean + turning * np.cos(2 * angle),
        "xy": -turning * np.sin(2 * angle),
        "zx": coupling * np.cos(angle),
        "zy": coupling * np.sin(angle),
    }
    functions = radial_functions(layer, 8.0)
    for component in COMPONENTS:
        got = (base.at(component, functions, seen_x - x, seen_y - y) * load).sum()
        # the lattice's own error is exp(−2(πw/pitch)²) and the load's tail exp(−½(16·0.37)²) = 2e-8
        assert got == pytest.approx(exact[component], rel=1e-7, abs=1e-7 * abs(exact["nn"])), component


@pytest.mark.parametrize("thickness", [5e-4, 2e-3, 0.5])
@pytest.mark.parametrize("component", COMPONENTS)
def test_a_cell_is_the_integral_of_a_point(thickness: float, component: Component) -> None:
    base, pitch = LayerBase(thickness, YOUNG, 0.4), (8e-4, 5e-4)
    got = base.influence(component, Grid((3, 3), pitch))
    functions = radial_functions(base.layer(), 64.0)
    node, weight = np.polynomial.legendre.leggauss(40)
    for i, j in ((0, 0), (1, 2), (2, 1)):
        x, y = np.meshgrid((j + 0.5 * node) * pitch[0], (i + 0.5 * node) * pitch[1])
        exact = 0.25 * weight @ base.at(component, functions, x, y) @ weight * pitch[0] * pitch[1]
        assert got[i, j] == pytest.approx(exact, rel=1e-9, abs=1e-10 * np.abs(got).max())


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.49, 0.5])
@pytest.mark.parametrize("component", ["nn", "xx", "yy", "xy", "zx"])
def test_far_from_the_load_a_layer_does_not_give_way(poisson: float, component: Component) -> None:
    half_space, base = bodies(1e-4, poisson)
    grid = Grid((40, 40), (2.5e-4, 2.5e-4))
    free, taken = half_space.influence(component, grid), base.influence(component, grid)
    free = np.zeros(grid.shape) if free is None else free
    far = np.hypot(*np.meshgrid(np.arange(40), np.arange(40))) > 20  # 50 thicknesses
    np.testing.assert_allclose(taken[far], -free[far], rtol=0.0, atol=1e-9 * np.abs(taken).max())


def test_a_thick_layer_meets_the_half_space_to_first_order_in_its_inverse() -> None:
    """At the origin the base takes (1/2π)∫ ΔC k dk ∝ 1/h, far below the half-space's 1/r."""
    grid = Grid.square(32, 10e-3)
    free = HalfSpace.from_young(YOUNG, 0.49).influence("nn", grid)
    for thickness in (1.0, 1e3):
        taken = LayerBase(thickness, YOUNG, 0.49).influence("nn", grid)
        np.testing.assert_allclose(taken / free, 0.0, atol=2.5 * 14e-3 / thickness)
        assert np.ptp(taken) < 1e-3 * np.abs(taken).max()  # a constant: it shifts the approach and no pressure


def pressed(thickness: float | None, poisson: float, force: float, width: float, cells: int = 48):
    half_space, base = bodies(thickness or 1.0, poisson)
    grid = Grid.square(cells, width)
    x, y = grid.points()
    operators = Operators((half_space,) if thickness is None else (half_space, base))
    return grid, solve_normal(operators, grid, (x**2 + y**2) / (2 * RADIUS), force=force, tolerance=1e-9)


def test_pressure_on_a_layer_of_a_metre_is_that_on_a_half_space() -> None:
    _, free = pressed(None, 0.49, 10.0, 10e-3)
    _, thick = pressed(1.0, 0.49, 10.0, 10e-3)
    np.testing.assert_allclose(thick.pressure, free.pressure, rtol=0.0, atol=1e-4 * free.pressure.max())


@pytest.mark.parametrize(("thickness", "rtol"), [(0.1, 2e-4), (0.05, 5e-4), (0.02, 1.5e-3), (0.01, 2e-3)])
def test_a_base_stiffens_an_incompressible_gel_as_indentation_theory_has_it(thickness: float, rtol: float) -> None:
    """F/F_Hertz = 1 + 1.133χ + 1.497χ² + 1.469χ³ + 0.755χ⁴, χ = √(Rδ)/h (Garcia & Garcia, Biophys. J. 114 (2018) 2923;
    the first term as in Dimitriadis et al., Biophys. J. 82 (2002) 2798).
    """
    depth = 5e-4
    radius = np.sqrt(RADIUS * depth)
    grid = Grid.square(64, 2.6 * radius)
    x, y = grid.points()
    force = [
        solve_normal(Operators(finger), grid, (x**2 + y**2) / (2 * RADIUS), approach=depth).force
        for finger in (bodies(thickness, 0.5), bodies(thickness, 0.5)[:1])
    ]
    chi = radius / thickness
    series = 1 + 1.133 * chi + 1.497 * chi**2 + 1.469 * chi**3 + 0.755 * chi**4
    assert force[0] / force[1] == pytest.approx(series, rel=rtol)


def test_a_thin_layer_is_a_bed_of_springs() -> None:
    """Johnson, Contact Mechanics, §5.8: p = M (a² − r²) / 2Rh with the confined modulus M."""
    poisson, thickness, radius = 0.2, 1e-4, 3e-3
    confined = YOUNG * (1 - poisson) / ((1 + poisson) * (1 - 2 * poisson))
    force = np.pi * confined * radius**4 / (4 * RADIUS * thickness)
    grid, contact = pressed(thickness, poisson, force, 8e-3, cells=64)
    r = np.hypot(*grid.points())
    exact = confined * np.maximum(radius**2 - r**2, 0.0) / (2 * RADIUS * thickness)
    inside = r < radius - 3 * thickness  # the layer's own length scale smooths the edge
    np.testing.assert_allclose(contact.pressure[inside], exact[inside], rtol=0.0, atol=2e-3 * exact.max())


def test_a_thin_incompressible_layer_is_a_squeezed_film() -> None:
    """Lubrication in the layer: h³∇²p = −3G (δ − r²/2R), so p = 3G (a² − r²)² / 32Rh³ (cf. Johnson, §5.8)."""
    errors, radius, shear = [], 4e-3, YOUNG / 3.0
    for thickness in (4e-4, 2e-4):
        force = np.pi * shear * radius**6 / (32 * RADIUS * thickness**3)
        grid, contact = pressed(thickness, 0.5, force, 10e-3, cells=64)
        r = np.hypot(*grid.points())
        exact = 3 * shear * np.maximum(radius**2 - r**2, 0.0) ** 2 / (32 * RADIUS * thickness**3)
        errors.append(float(np.abs(contact.pressure - exact).max() / exact.max()))
    assert errors[1] < 0.02
    assert errors[1] < 0.7 * errors[0]  # of first order in thickness over contact radius


def test_a_layer_costs_no_application_by_itself() -> None:
    loads = [StepLoad(10.0, tangential=np.array([f, 0.0, 0.0])) for f in (0.0, 1.0, 2.0, 3.0)]
    counts = []
    for finger in (bodies(5e-3, 0.49), bodies(5e-3, 0.49)[:1]):
        problem = ContactProblem(finger, FRICTION, heights=(lambda x, y: (x**2 + y**2) / (2 * RADIUS),))
        solver = QuasiStatic(problem, Grid.square(32, 12e-3), 1e-4)
        list(solver.run(loads))
        counts.append(solver.count.normal + solver.count.tangential)
        assert solver.count.coupling == 0
    assert counts[0] <= 1.25 * counts[1]  # the same solver on other kernels; only its iterations differ


@pytest.mark.parametrize("pitch", [0.1, 0.25, 1.0, 4.0, 8.0])
def test_points_over_a_cell_are_as_many_as_a_pole_two_thicknesses_away_needs(pitch: float) -> None:
    """To 1e-12 of ∫ dx/(x² + 4) over the cell; two fewer miss it."""
    for count, is_met in ((_points(pitch), True), (_points(pitch) - 2, False)):
        node, weight = np.polynomial.legendre.leggauss(count)
        found = weight @ (0.5 * pitch / ((0.5 * pitch * node) ** 2 + 4.0))
        assert (abs(found / np.arctan(0.25 * pitch) - 1.0) < 2e-12) == is_met
