"""Cases at the bounds of what the solver takes, against closed forms, resultants and what no path may do."""

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ellipkm1, iv

from slipcore.contact.elasticity.bonded_layer import LayerBase
from slipcore.contact.elasticity.grid import Grid
from slipcore.contact.elasticity.influence import MirroredBody
from slipcore.contact.elasticity.operator import Operators
from slipcore.contact.errors import InfeasibleLoad
from slipcore.contact.reference.cylinder import CylinderContact
from slipcore.contact.reference.elastic_pair import half_space
from slipcore.contact.reference.hertz import HertzContact
from slipcore.contact.reference.mindlin_deresiewicz import MindlinDeresiewicz
from slipcore.contact.solver.normal import solve_normal
from slipcore.contact.solver.problem import ContactProblem, StepLoad
from slipcore.contact.solver.quasi_static import QuasiStatic
from slipcore.contact.solver.state import StepResult
from slipcore.frames import FloatArray
from tests.slipcore.contact.solver.following import (
    FORCE,
    FRICTION,
    RADIUS,
    SLIDING,
    YOUNG,
    at,
    body,
    bowl,
    follow,
    follow_on,
    moved,
    problem,
)

PUNCH, DEPTH = 4e-3, 1e-4


def round_punch(x: FloatArray, y: FloatArray) -> FloatArray:
    return np.where(np.hypot(x, y) <= PUNCH, 0.0, np.inf)


def pushed(scene: ContactProblem, cells: int = 32) -> StepResult:
    """A flat round punch pushed in at once."""
    return follow(scene, [StepLoad(approach=DEPTH)], cells, 2.3 * PUNCH, bound=60, tolerance=1e-6)[-1]


def along_radius(result: StepResult, x: FloatArray, y: FloatArray) -> float:
    """Sum of the tractions' components away from the axis."""
    return float((result.force[0] * x + result.force[1] * y).sum())


@pytest.mark.parametrize("poisson", [0.0, 0.25, 0.49])
def test_a_punch_that_cannot_slip_presses_as_mossakovskii_has_it(poisson: float) -> None:
    """Without slip F = 4 G a δ ln(3 − 4ν)/(1 − 2ν) (Spence, Proc. R. Soc. A 305 (1968) 55); Dundurs' β is ½ at ν 0."""
    stuck = pushed(problem(poisson, friction=10.0, height=round_punch, coupled=True))
    smooth = pushed(problem(poisson, height=round_punch))  # on the same cells, whose error is not the question
    assert stuck.stick_ratio == 1.0
    exact = (1.0 - poisson) * np.log(3.0 - 4.0 * poisson) / (1.0 - 2.0 * poisson)
    assert stuck.force[2].sum() / smooth.force[2].sum() == pytest.approx(exact, rel=3e-3)  # 32 cells: 2.1e-3 at ν = 0


def spence(share: float) -> float:
    """Stick area over contact area under pressing with friction μ = ``share`` β, β Dundurs': with k = c/a the root of
    ln((1 + k)/(1 − k))/2k = (μ/β) K(√(1 − k²)), alike for a flat punch and a sphere (Spence, J. Elasticity 5 (1975)
    297); tractions that move no pressure are assumed, as next to ν = ½.
    """
    ring = brentq(lambda k: np.log((1.0 + k) / (1.0 - k)) / (2.0 * k) - share * ellipkm1(k**2), 1e-6, 1.0 - 1e-9)
    return float(ring) ** 2


def dundurs(poisson: float) -> float:
    return (1.0 - 2.0 * poisson) / (2.0 * (1.0 - poisson))


@pytest.mark.parametrize("share", [0.5, 0.7, 0.9])
def test_a_pressed_punch_slips_in_spences_ring(share: float) -> None:
    result = pushed(problem(0.48, share * dundurs(0.48), round_punch, coupled=True), 64)
    assert result.stick_ratio == pytest.approx(spence(share), abs=6e-3)  # a row of cells is 0.05 of the area


@pytest.mark.parametrize("share", [0.5, 0.9])
def test_a_pressed_sphere_comes_to_slip_in_spences_ring_with_its_load_steps(share: float) -> None:
    """Of first order in the steps: cells that slip at a step's begin and stick at its end count as slipping."""
    scene, errors = problem(0.48, share * dundurs(0.48), coupled=True), []
    width = 2.3 * HertzContact(RADIUS, FORCE, half_space(YOUNG, 0.48)).contact_radius
    for steps in (8, 32):
        loads = [at(FORCE * (step / steps) ** 3) for step in range(1, steps + 1)]
        last = follow(scene, loads, 64, width, bound=60, tolerance=1e-6)[-1]
        errors.append(abs(last.stick_ratio - spence(share)))
    assert errors[1] < min(0.03, 0.5 * errors[0])


def test_dundurs_beta_of_minus_a_half_mirrors_that_of_a_half() -> None:
    """A soft object on a hard finger presses as a soft finger on a hard object; shear turns round."""
    soft = problem(0.0, height=round_punch, coupled=True)
    hard = ContactProblem((body(0.5, 1e9 * YOUNG),), FRICTION, (MirroredBody(body(0.0)),), (round_punch,), coupled=True)
    usual, mirrored = pushed(soft), pushed(hard)
    np.testing.assert_allclose(mirrored.force[2], usual.force[2], rtol=0.0, atol=1e-5 * usual.force[2].max())
    np.testing.assert_allclose(mirrored.force[:2], -usual.force[:2], rtol=0.0, atol=1e-5 * usual.force[2].max())
    x, y = Grid.square(32, 2.3 * PUNCH).points()
    assert along_radius(usual, x, y) * along_radius(mirrored, x, y) < 0.0


def layer(
    thickness: float, poisson: float, height: Callable[..., FloatArray], friction: float = FRICTION
) -> ContactProblem:
    bodies = (body(poisson), LayerBase(thickness, YOUNG, poisson))
    return ContactProblem(bodies, friction, heights=(height,), coupled=True)


def squeezed(thickness: float, poisson: float, held: float) -> float:
    """Force N on a thin layer under a flat punch: h p/M − (h³/cG) ∇²p = δ with p = 0 at the edge (lubrication).

    ``held``: c, 3 where the layer slips freely along the punch and 12 where it is stuck; M: modulus without lateral
    strain.
    """
    shear = YOUNG / (2.0 * (1.0 + poisson))
    modulus = 2.0 * shear * (1.0 - poisson) / (1.0 - 2.0 * poisson)
    edge = np.sqrt(held * shear / modulus) * PUNCH / thickness
    return float(np.pi * PUNCH**2 * modulus * DEPTH / thickness * (1.0 - 2.0 * iv(1, edge) / (edge * iv(0, edge))))


@pytest.mark.parametrize(("friction", "held", "edge"), [(0.0, 3.0, 0.35), (10.0, 12.0, 0.1)])
def test_a_nearly_incompressible_layer_is_squeezed_as_lubrication_has_it(
    friction: float, held: float, edge: float
) -> None:
    """ν = 0.4999. Stuck to the punch, too, it is up to four times as stiff: all by normal-tangential coupling."""
    errors = []
    for thickness in (PUNCH / 5.0, PUNCH / 20.0):
        force = float(pushed(layer(thickness, 0.4999, round_punch, friction), 40).force[2].sum())
        errors.append(abs(force / squeezed(thickness, 0.4999, held) - 1.0))
    assert errors[1] <= edge  # the theory has none: it is a thickness wide, a twentieth of the radius, wider if free
    assert errors[1] < 0.5 * errors[0]


@pytest.mark.parametrize("poisson", [0.3, 0.4999])
def test_a_layer_of_a_twentieth_of_the_contact_is_pressed_sheared_and_reversed(poisson: float) -> None:
    """Its lift by traction is as large as the indentation; the mixing of the last points must still converge."""
    thin, force = layer(0.2e-3, poisson, bowl), 50.0
    path = [*(force * (k / 8.0) ** 3 for k in range(1, 9))]
    loads = [*map(at, path), *(at(force, share * FRICTION * force) for share in (0.3, 0.6, 0.9, 0.2))]
    results = follow(thin, loads, 20, 8e-3, bound=200, tolerance=1e-5)
    assert results[-2].stick_ratio < results[-4].stick_ratio
    assert results[-1].force[0].sum() == pytest.approx(0.2 * FRICTION * force, rel=1e-9)


def reversals(scene: ContactProblem, count: int, steps: int = 1) -> list[StepResult]:
    """Pulled to 0.7 of sliding and back, so many times each way."""
    ends = 0.7 * SLIDING * np.array([0.0, *(1.0 if k % 2 == 0 else -1.0 for k in range(count + 1))])
    pulls = np.concatenate([np.linspace(a, b, steps + 1)[1:] for a, b in pairwise(ends)])
    return follow(scene, [at(FORCE), *(at(FORCE, pull) for pull in pulls)], 16, bound=60)[steps::steps]


def taken(result: StepResult) -> float:
    """Energy J that friction takes in a step."""
    return -float((result.force[:2] * result.slip).sum())


@pytest.mark.parametrize("poisson", [0.0, 0.3])
def test_two_hundred_reversals_close_their_loops(poisson: float) -> None:
    """No ratcheting: where the first loop ends, the hundredth ends."""
    results = reversals(problem(poisson), 200)
    there, back = (np.array([result.pose[0] for result in results[k::2]]) for k in (0, 1))
    for ends in (there[1:], back):  # the first way there is from rest
        np.testing.assert_allclose(ends, ends[0], rtol=1e-6, atol=0.0)
    size = np.abs(results[2].force[0]).max()
    np.testing.assert_allclose(results[-1].force, results[2].force, rtol=0.0, atol=1e-6 * size)
    work = np.array([taken(result) for result in results[1:]])
    np.testing.assert_allclose(work, work[1], rtol=1e-6, atol=0.0)
    contact = HertzContact(RADIUS, FORCE, half_space(YOUNG, 0.0))
    if poisson == 0.0:
        exact = MindlinDeresiewicz(contact, FRICTION).load(FORCE, 0.7 * SLIDING)
        assert there[-1] == pytest.approx(exact.rigid_displacement, rel=0.02)  # 16 cells
        assert back[-1] == pytest.approx(-there[-1], rel=1e-6)


@pytest.mark.long
@pytest.mark.parametrize("poisson", [0.0, 0.3])
def test_two_hundred_reversals_of_a_coupled_contact_shake_down(poisson: float) -> None:
    """Pressing left a shear that reversals take away: by ever less, which is no ratcheting."""
    results = reversals(problem(poisson, coupled=True), 200, steps=2)
    for ends in (np.array([result.pose[0] for result in results[k::2]]) for k in (0, 1)):
        drift = np.abs(np.diff(ends))
        assert (drift[85:] <= drift[84:-1]).all()  # at ν = 0.3 it is largest at drift[81]
        assert drift[-1] <= 3e-6 * abs(ends[-1])
    assert min(taken(result) for result in results[1:]) > 0.0


@pytest.mark.parametrize(("poisson", "coupled"), [(0.3, False), (0.3, True), (0.49, True)])
def test_a_contact_that_vanishes_while_it_slips_takes_friction_to_the_last(poisson: float, coupled: bool) -> None:
    scene = problem(poisson, coupled=coupled)
    forces = FORCE * np.geomspace(1.0, 1e-7, 8)
    loads = [at(FORCE), moved(FORCE, 1e-3, 0.0, 0.0), *(moved(force, 1e-4, 0.0, 0.0) for force in forces)]
    results = follow(scene, [*loads, moved(0.0, 1e-4, 0.0, 0.0), at(FORCE)], 24, bound=60, tolerance=1e-6)
    for result, force in zip(results[2:-2], forces, strict=True):
        assert result.sliding
        assert result.force[0].sum() == pytest.approx(FRICTION * force, rel=0.01)  # it slips a little apart, too
        assert taken(result) > 0.0
    apart, anew = results[-2:]
    assert not apart.contact.any()
    assert apart.pose[0] == pytest.approx(1.9e-3, rel=1e-12)
    fresh = follow(scene, [at(FORCE)], 24, bound=60, tolerance=1e-6)[-1]
    np.testing.assert_allclose(anew.force, fresh.force, rtol=0.0, atol=1e-5 * fresh.force[2].max())


def test_a_contact_that_vanishes_under_a_load_that_vanishes_with_it_meets_its_closed_form() -> None:
    """F_T falls faster than F_N, then more slowly: it slips back, then on (Mindlin and Deresiewicz)."""
    path = [(FORCE, 0.5 * SLIDING), (5.0, 0.2), (2.0, 0.5), (0.5, 0.19), (0.02, 0.0079)]
    results = follow(problem(0.0), [at(FORCE), *(at(*loads) for loads in path), at(0.0)], 32)
    exact = MindlinDeresiewicz(HertzContact(RADIUS, FORCE, half_space(YOUNG, 0.0)), FRICTION)
    for result, loads in zip(results[1:4], path[:3], strict=True):  # then only a few cells touch
        exact = exact.load(*loads)
        assert result.pose[0] == pytest.approx(exact.rigid_displacement, rel=0.03, abs=3e-6)  # 32 cells
    assert not results[-1].contact.any()


def halves(x: FloatArray, _: FloatArray) -> FloatArray:
    return np.where(x < 0.0, 0.04, 4.0)


def chequered(x: FloatArray, y: FloatArray) -> FloatArray:
    return np.where((np.floor(x / 1e-3) + np.floor(y / 1e-3)) % 2 == 0, 0.04, 4.0)


@pytest.mark.parametrize("friction", [halves, chequered])
def test_friction_that_jumps_by_100_carries_what_its_cells_add_up_to(friction: Callable[..., FloatArray]) -> None:
    grid = Grid.square(32, 11e-3)
    x, y = grid.points()
    pressure = solve_normal(Operators((body(),)), grid, bowl(x, y), force=FORCE, tolerance=1e-9).pressure
    limit = friction(x, y) * pressure * grid.cell_area
    carried, about = float(limit.sum()), -float((limit * y).sum())  # a force through the centre of friction
    scene = problem(friction=0.0, friction_fields=(friction,))
    turned = -float((limit * x).sum())
    path = [at(FORCE), *(at(FORCE, 0.0, share * carried, -share * turned) for share in (0.5, 0.95, -0.95, 0.999))]
    assert 0.0 < follow(scene, path)[-1].stick_ratio < 1.0
    assert about == pytest.approx(0.0, abs=1e-9 * carried)  # both fields are alike above and below
    with pytest.raises(InfeasibleLoad) as error:
        follow(scene, [at(FORCE), at(FORCE, 0.0, 1.05 * carried, -1.05 * turned)])
    assert 1.0 / error.value.factor == pytest.approx(1.05, rel=1e-6)


def test_three_by_three_cells_are_pressed_sheared_turned_and_twisted() -> None:
    path = [(0.5, 0.0, 0.0), (0.9, 0.0, 0.0), (-0.9, 0.0, 0.0), (0.0, 0.7, 0.0), (0.3, 0.3, 2e-4)]
    for coupled in (False, True):
        for height in (bowl, round_punch):
            loads = [at(FORCE), *(at(FORCE, *(SLIDING * np.array(share))) for share in path)]
            scene = problem(0.3, height=height, coupled=coupled)
            results = follow(scene, loads, 3, 6e-3, bound=60, tolerance=1e-7)
            assert results[0].contact.any()
            np.testing.assert_allclose(results[-1].force[:2].sum(axis=(1, 2)), 0.3 * SLIDING, rtol=1e-9, atol=0.0)


def test_one_row_of_200_long_cells_is_a_cylinder() -> None:
    """Cells 200 contact widths long see each other as in plane strain, but for a constant."""
    load, pull = 1e3, 0.7 * FRICTION * 1e3  # N/m
    exact = CylinderContact(RADIUS, load, half_space(YOUNG, 0.5), FRICTION, pull)
    length = 400.0 * exact.half_width
    for shape in ((1, 200), (200, 1)):
        pitch = 2.1 * exact.half_width / 200
        across = shape[0] == 1
        grid = Grid(shape, (pitch, length) if across else (length, pitch))
        roller = problem(0.5, height=lambda x, y, across=across: (x if across else y) ** 2 / (2.0 * RADIUS))
        forces = [length * load, 0.0, 0.0], [length * load, *((length * pull, 0.0) if across else (0.0, length * pull))]
        result = follow_on(grid, roller, [at(*force) for force in forces])[-1]
        pressure, along = (result.force[k].ravel() / grid.cell_area for k in (2, 0 if across else 1))
        at_cells = (grid.x if across else grid.y).ravel()
        # the constant and the jump of a cell at the edge
        np.testing.assert_allclose(pressure, exact.pressure(at_cells), rtol=0.0, atol=0.05 * exact.peak_pressure)
        assert np.sqrt(np.mean((pressure - exact.pressure(at_cells)) ** 2)) <= 5e-3 * exact.peak_pressure
        assert np.sqrt(np.mean((along - exact.traction(at_cells)) ** 2)) <= 5e-3 * FRICTION * exact.peak_pressure


def on_the_boundary(steps: int) -> None:
    """Loads that friction just carries: held, turning, and rising and falling with the normal force."""
    angle = np.linspace(0.0, 4.0 * np.pi, steps)
    held = [at(FORCE, SLIDING)] * steps
    turning = [at(FORCE, *SLIDING * np.array([np.cos(a), np.sin(a)])) for a in angle]
    breathing = [at(force, FRICTION * force) for force in FORCE * (1.0 + 0.5 * np.sin(angle))]
    for loads in (held, turning, breathing):
        solver = QuasiStatic(problem(), Grid.square(16, 13e-3), 1e-6, 1e-8, second_order=True)
        poses = []
        for load, result in zip([at(FORCE), *loads], solver.run([at(FORCE), *loads]), strict=True):
            poses.append(result.pose[:2])
            if len(poses) == 1:
                continue
            direction = load.tangential[:2] / np.hypot(*load.tangential[:2])
            sliding = FRICTION * direction[:, None, None] * result.force[2]  # no other tractions add up to the load
            np.testing.assert_allclose(result.force[:2], sliding, rtol=0.0, atol=1e-9 * result.force[2].max())
            assert result.stick_ratio == 0.0
            assert taken(result) >= -1e-12 * abs(result.force[:2]).sum() * RADIUS
        if loads is held:
            np.testing.assert_allclose(poses[1:], np.tile(poses[1], (steps, 1)), rtol=1e-9, atol=1e-12)
        assert np.hypot(*np.transpose(poses)).max() <= 2.0 * np.hypot(*poses[1])  # the least motion: it never runs off


def test_loads_on_the_boundary_of_sliding_for_100_steps() -> None:
    on_the_boundary(100)


@pytest.mark.long
def test_loads_on_the_boundary_of_sliding_for_1000_steps() -> None:
    on_the_boundary(1000)
