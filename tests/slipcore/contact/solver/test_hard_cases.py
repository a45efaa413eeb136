"""The hard cases by name: each converges within BOUND Newton steps a load step, balanced and complementary, or gives
its documented error. Warnings are errors here, so that no overflow or division passes unseen.
"""

import numpy as np
import pytest

from slipcore.contact.effects import FiniteLayer
from slipcore.contact.elasticity.grid import Grid
from slipcore.contact.elasticity.influence import MirroredBody
from slipcore.contact.elasticity.operator import Operators
from slipcore.contact.errors import InfeasibleLoad
from slipcore.contact.limit_load import limit_load
from slipcore.contact.plan.plan import Plan
from slipcore.contact.reference.cattaneo_mindlin import CattaneoMindlin
from slipcore.contact.reference.torsion import sliding_moment
from slipcore.contact.scene import Scene
from slipcore.contact.solver.normal import solve_normal
from slipcore.contact.solver.problem import ContactProblem, MaxwellBranch, StepLoad
from slipcore.contact.solver.quasi_static import QuasiStatic
from slipcore.errors import InvalidInput
from tests.slipcore.contact.solver.following import (
    BOUND,
    FORCE,
    FRICTION,
    RADIUS,
    SLIDING,
    YOUNG,
    at,
    body,
    bowl,
    follow,
    moved,
    problem,
)


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.5])
@pytest.mark.parametrize("share", [1e-6, 1e-3, 0.05, 0.9, 1 - 1e-3, 1 - 1e-4, 1 - 1e-6, 1 - 1e-9])
def test_forces_from_almost_none_to_almost_sliding(share: float, poisson: float) -> None:
    last = follow(problem(poisson), [at(FORCE), at(FORCE, share * SLIDING)])[-1]
    assert last.force[0].sum() == pytest.approx(share * SLIDING, rel=1e-9)
    assert (last.stick_ratio == 0.0) == last.sliding or poisson == 0.0


def test_almost_sliding_without_lateral_slip_has_the_motion_of_the_closed_form(sphere) -> None:
    hertz = sphere(32).hertz
    for share in (0.999, 1 - 1e-6, 1 - 1e-9):
        last = follow(problem(0.0), [at(FORCE), at(FORCE, share * SLIDING)], width=2.1 * hertz.contact_radius)[-1]
        exact = CattaneoMindlin(hertz, FRICTION, share * SLIDING)
        assert last.pose[0] == pytest.approx(exact.rigid_displacement, rel=3e-3)


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.5])
def test_force_at_exactly_the_sliding_force_slides(poisson: float) -> None:
    last = list(QuasiStatic(problem(poisson), Grid.square(32, 11e-3)).run([at(FORCE), at(FORCE, 0.0, SLIDING)]))[-1]
    assert last.sliding  # any motion that is large enough will do, so complementarity says nothing here
    assert last.imbalance <= 1e-12
    assert last.stick_ratio == 0.0
    np.testing.assert_allclose(last.force[1], FRICTION * last.force[2], rtol=1e-9, atol=1e-15)


@pytest.mark.parametrize("share", [1 + 1e-9, 1.1, 1e6])
def test_force_above_the_sliding_force_is_refused_with_how_far(share: float) -> None:
    with pytest.raises(InfeasibleLoad, match="times what friction carries") as error:
        follow(problem(), [at(FORCE), at(FORCE, share * SLIDING)])
    assert 1.0 / error.value.factor == pytest.approx(share, rel=1e-10)


def edge_of_sliding(angle: float) -> np.ndarray:
    """The largest load [N, N, N m] with a force along x and a moment in the ratio of a direction's parts."""
    grid = Grid.square(32, 11e-3)
    x, y = grid.points()
    pressure = solve_normal(Operators((body(),)), grid, bowl(x, y), force=FORCE, tolerance=1e-9).pressure
    limit = FRICTION * pressure.ravel()
    arm = np.stack((x.ravel(), y.ravel())) / 5e-3
    direction = np.array([np.cos(angle), 0.0, np.sin(angle)])
    factor = limit_load(limit, arm, direction, np.ones(3, dtype=bool)).factor * grid.cell_area
    return np.asarray(factor * direction * [1.0, 1.0, 5e-3])


@pytest.mark.parametrize("angle", [0.1, 0.8, 1.5])
def test_force_and_moment_inside_on_and_outside_the_limit_surface(angle: float) -> None:
    edge = edge_of_sliding(angle)
    for share in (0.99, 1 - 1e-4, 1 - 1e-7):
        assert follow(problem(), [at(FORCE), at(FORCE, *(share * edge))])[-1].force[0].sum() == pytest.approx(
            share * edge[0], rel=1e-9
        )
    with pytest.raises(InfeasibleLoad) as error:
        follow(problem(), [at(FORCE), at(FORCE, *(1.01 * edge))])
    assert 1.0 / error.value.factor == pytest.approx(1.01, rel=1e-6)


@pytest.mark.parametrize("left", [1e-6, 1e-7, 1e-8])
@pytest.mark.parametrize("angle", [1.5, 1.55])
def test_a_load_close_to_the_limit_of_torsion_takes_as_few_rounds_as_others(angle: float, left: float) -> None:
    """Nearly all cells move along their circles then, and a turn hardly lies in what they may do."""
    last = follow(problem(), [at(FORCE), at(FORCE, *((1.0 - left) * edge_of_sliding(angle)))])[-1]
    assert last.iterations <= 10


def test_a_moment_on_a_single_cell_is_refused() -> None:
    for load in (at(1e-7, 0.0, 0.0, 1e-12), at(1e-7, 1e-9, 0.0, 1e-12)):
        with pytest.raises(InfeasibleLoad):
            follow(problem(), [at(1e-7), load], cells=33)


def test_a_force_on_a_single_cell_is_carried_up_to_its_limit() -> None:
    assert follow(problem(), [at(1e-7), at(1e-7, 0.5 * FRICTION * 1e-7)], cells=33)[-1].stick_ratio == 1.0
    with pytest.raises(InfeasibleLoad):
        follow(problem(), [at(1e-7), at(1e-7, 1.5 * FRICTION * 1e-7)], cells=33)


def test_a_load_on_bodies_apart_is_refused_and_a_motion_is_free() -> None:
    with pytest.raises(InfeasibleLoad):
        follow(problem(), [at(0.0, 1e-3)])
    result = follow(problem(), [moved(0.0, 1e-3, 0.0, 0.1)])[-1]
    np.testing.assert_array_equal(result.pose, [1e-3, 0.0, 0.1])
    assert not result.sliding


def test_no_friction_carries_nothing_and_slides_freely() -> None:
    with pytest.raises(InfeasibleLoad):
        follow(problem(friction=0.0), [at(FORCE), at(FORCE, 1e-9)])
    for laws in ((), (lambda v: -1e-3 * v,)):
        last = follow(problem(friction=0.0, velocity_laws=laws), [at(FORCE), moved(FORCE, 1e-3, 0.0, 0.0)])[-1]
        assert not last.force[:2].any()
        assert last.pose[0] == 1e-3


@pytest.mark.parametrize("friction", [0.01, 10.0])
def test_motion_is_in_proportion_to_friction_at_the_same_share_of_sliding(friction: float) -> None:
    usual = follow(problem(), [at(FORCE), at(FORCE, 0.7 * SLIDING)])[-1]
    last = follow(problem(friction=friction), [at(FORCE), at(FORCE, 0.7 * friction * FORCE)])[-1]
    assert last.pose[0] / usual.pose[0] == pytest.approx(friction / FRICTION, rel=1e-7)
    assert last.stick_ratio == usual.stick_ratio


def test_friction_with_noise_of_30_percent() -> None:
    noise = 0.3 * FRICTION * np.random.default_rng(1).standard_normal((32, 32))
    path = [at(FORCE), at(FORCE, 0.6 * SLIDING), at(FORCE, 0.85 * SLIDING), at(FORCE, -0.5 * SLIDING)]
    results = follow(problem(friction_fields=(lambda *_: noise,)), path)
    assert 0.0 < results[-1].stick_ratio < 1.0


def test_poisson_ratios_up_to_incompressible_meet() -> None:
    path = [at(FORCE), at(FORCE, 0.7 * SLIDING, 0.0, 3e-3)]
    for coupled in (False, True):  # coupling vanishes with 1 − 2ν
        almost, incompressible = (
            follow(problem(nu, coupled=coupled), path, bound=60, tolerance=1e-6)[-1] for nu in (0.4999, 0.5)
        )
        assert almost.pose[0] == pytest.approx(incompressible.pose[0], rel=2e-4)


@pytest.mark.parametrize("poisson", [0.0, 0.2])
def test_strong_coupling_of_compressible_bodies_converges(poisson: float) -> None:
    path = [at(FORCE), at(FORCE, 0.7 * SLIDING)]
    last = follow(problem(poisson, coupled=True), path, bound=60, tolerance=1e-6)[-1]
    assert last.force[0].sum() == pytest.approx(0.7 * SLIDING, rel=1e-10)


def test_normal_forces_over_nine_decades_are_alike() -> None:
    motions = []
    for force in (1e-6, 1e-3, 1.0, 1e3):
        scale = (force / FORCE) ** (1 / 3)
        path = [at(force), at(force, 0.7 * FRICTION * force)]
        motions.append(follow(problem(), path, width=11e-3 * scale)[-1].pose[0] / scale**2)
    np.testing.assert_allclose(motions, motions[0], rtol=1e-6)  # the tolerance of two solves


def ring(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return bowl(x, y) + (np.hypot(x, y) - 4e-3) ** 2 / (2 * 2e-3)


def square_punch(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return np.where(np.maximum(abs(x), abs(y)) <= 4e-3, 0.0, np.inf)


def two_spheres(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return np.minimum((x - 6e-3) ** 2, (x + 6e-3) ** 2) / (2 * RADIUS) + y**2 / (2 * RADIUS)


def rough(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Self-affine roughness of 100 µm on a sphere: spots of contact that come and go."""
    rng, (ny, nx) = np.random.default_rng(5), x.shape
    wave = np.hypot(np.fft.fftfreq(ny)[:, None], np.fft.rfftfreq(nx))
    wave[0, 0] = np.inf
    spectrum = rng.standard_normal(wave.shape) + 1j * rng.standard_normal(wave.shape)
    noise = np.fft.irfft2(spectrum * wave**-1.8, s=x.shape)
    return bowl(x, y) + 100e-6 * noise / noise.std()


SHAPES = [(ring, 14e-3), (square_punch, 10e-3), (two_spheres, 24e-3), (rough, 14e-3)]


@pytest.mark.parametrize(("height", "width"), SHAPES, ids=lambda value: getattr(value, "__name__", ""))
def test_shapes_are_sheared_reversed_and_turned(height, width: float) -> None:
    path = [(0.5, 0.0, 0.0), (0.9, 0.0, 0.0), (-0.5, 0.0, 0.0), (0.0, 0.7, 2e-3 / SLIDING)]
    for poisson in (0.0, 0.5):
        loads = [at(FORCE), *(at(FORCE, *(SLIDING * np.array(share))) for share in path)]
        assert follow(problem(poisson, height=height), loads, 48, width)[-1].force[1].sum() == pytest.approx(2.8)


def test_contact_that_loses_and_regains_area_forgets_what_it_lost() -> None:
    loads = [at(FORCE), at(FORCE, 0.9 * SLIDING), at(2.0, 0.5), at(0.0), at(FORCE), at(FORCE, 0.5 * SLIDING)]
    results = follow(problem(), loads)
    assert not results[3].contact.any()
    anew = follow(problem(), [at(FORCE), at(FORCE, 0.5 * SLIDING)])[-1]
    np.testing.assert_allclose(results[-1].force, anew.force, rtol=0.0, atol=1e-6 * anew.force.max())


@pytest.mark.parametrize("share", [0.9, 0.9999])
def test_one_step_reversal_mirrors_the_traction(share: float) -> None:
    results = follow(problem(), [at(FORCE), at(FORCE, share * SLIDING), at(FORCE, -share * SLIDING)])
    size = results[1].force[0].max()
    np.testing.assert_allclose(results[2].force[0], -results[1].force[0], rtol=0.0, atol=1e-4 * size)
    assert results[2].pose[0] == pytest.approx(-results[1].pose[0], rel=1e-3)


def test_load_that_turns_by_90_degrees() -> None:
    last = follow(problem(), [at(FORCE), at(FORCE, 0.9 * SLIDING), at(FORCE, 0.0, 0.9 * SLIDING)])[-1]
    np.testing.assert_allclose(last.force[:2].sum(axis=(1, 2)), [0.0, 0.9 * SLIDING], atol=1e-9 * SLIDING)
    assert np.abs(last.force[0]).max() > 0.01 * last.force[1].max()  # what sticks remembers where it came from


def tiny_steps(count: int) -> None:
    """The first hundredths of the way to sliding in steps of 1/10,000 of it: no drift, few iterations."""
    solver = QuasiStatic(problem(0.0), Grid.square(24, 11e-3), 1e-6, 1e-8)
    state, _ = solver.step(solver.start(), at(FORCE))
    for k in range(1, count + 1):
        state, result = solver.step(state, at(FORCE, 0.9e-4 * k * SLIDING))
        assert result.iterations <= 10
        assert result.imbalance <= 1e-10
    once = follow(problem(0.0), [at(FORCE), at(FORCE, 0.9e-4 * count * SLIDING)], cells=24)[-1]
    assert result.pose[0] == pytest.approx(once.pose[0], rel=1e-6)  # monotone loading has no memory at ν = 0
    np.testing.assert_allclose(result.force[0], once.force[0], rtol=0.0, atol=1e-4 * once.force[0].max())


def test_200_tiny_steps_do_not_drift() -> None:
    tiny_steps(200)


@pytest.mark.long
def test_10000_tiny_steps_do_not_drift() -> None:
    tiny_steps(10_000)


def test_one_huge_step_from_nothing() -> None:
    assert 0.0 < follow(problem(), [at(FORCE, 0.8 * SLIDING, 0.2 * SLIDING, 1e-3)])[-1].stick_ratio < 1.0
    for motion in ((1.0, 0.0, 0.0), (1e3, 5.0, 100.0)):
        last = follow(problem(), [at(FORCE), moved(FORCE, *motion)])[-1]
        assert last.sliding
        np.testing.assert_array_equal(last.pose, motion)
    follow(problem(), [at(1e-3), at(1e-3, 2.8e-4), at(FORCE, 0.7 * SLIDING)])


def layered(thickness: float) -> Plan:
    return Scene("layer", (FiniteLayer(thickness),)).plan()


def test_a_layer_of_a_metre_meets_the_half_space_and_one_of_a_millimetre_is_stiffer() -> None:
    path = [at(FORCE), at(FORCE, 0.7 * SLIDING)]
    thick, thin = (follow(layered(h).problem, path, bound=60, tolerance=1e-6)[-1] for h in (1.0, 1e-3))
    half_space = follow(Scene("none").plan().problem, path)[-1]
    assert thick.pose[0] == pytest.approx(half_space.pose[0], rel=0.01)  # a/h = 5e-3 of compliance
    assert thick.approach == pytest.approx(half_space.approach, rel=0.01)
    assert thin.contact.sum() < 0.8 * half_space.contact.sum()
    assert thin.approach < 0.5 * half_space.approach


def test_a_stiff_object_meets_the_rigid_one() -> None:
    path = [at(FORCE), at(FORCE, 0.7 * SLIDING)]
    rigid = follow(problem(), path)[-1]
    for stiffer in (1e3, 1e9):
        elastic = follow(problem(obstacle=(MirroredBody(body(young=stiffer * YOUNG)),)), path)[-1]
        assert elastic.pose[0] == pytest.approx(rigid.pose[0], rel=2.0 / stiffer + 1e-7)


def test_units_do_not_matter() -> None:
    path = [(FORCE, 0.0, 0.0), (FORCE, 0.7 * SLIDING, 2e-3)]
    usual = follow(problem(), [at(n, t, 0.0, m) for n, t, m in path])[-1]
    for s in (1e-6, 1e6):
        wide = ContactProblem((body(),), FRICTION, heights=(lambda x, y, s=s: bowl(x, y) / s,))
        scaled = follow(wide, [at(n * s**2, t * s**2, 0.0, m * s**3) for n, t, m in path], width=11e-3 * s)[-1]
        np.testing.assert_allclose(scaled.pose, usual.pose * [s, s, 1.0], rtol=1e-7, atol=1e-12 * s)
        stiff = ContactProblem((body(young=YOUNG * s),), FRICTION, heights=(bowl,))
        scaled = follow(stiff, [at(n * s, t * s, 0.0, m * s) for n, t, m in path])[-1]
        np.testing.assert_allclose(scaled.pose, usual.pose, rtol=1e-7, atol=1e-12)


@pytest.mark.parametrize(("cells", "width"), [(64, 13.7e-3), (76, 13.4e-3), (92, 13.4e-3)])
def test_cells_with_hardly_any_pressure_may_turn_while_many_slide(cells: int, width: float) -> None:
    """A cylinder on a round gel that creeps: each step some cells touch that hardly bear, and turn far to slide."""
    angle = 2.514

    def cylinder(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return 0.5 * 5.18 * (np.cos(angle) * y - np.sin(angle) * x) ** 2

    gel = ContactProblem((body(0.49),), 0.534, heights=(bowl, cylinder), creep=(MaxwellBranch(0.374, 0.9585),))
    press = [StepLoad(force, duration=0.5) for force in (9.75, 19.5)]
    shear = [StepLoad(19.5, tangential=n * np.array([0.36, -0.175, -4e-4]), duration=0.025) for n in range(1, 9)]
    solver = QuasiStatic(gel, Grid.square(cells, width), 5e-4, 5e-6, second_order=True)
    assert max(result.iterations for result in solver.run(press + shear)) <= BOUND


@pytest.mark.parametrize("poisson", [0.0, 0.5])
def test_pure_torsion_up_to_sliding(sphere, poisson: float) -> None:
    case = sphere(33, poisson)  # an odd number of cells: one lies on the axis and never moves
    moment = sliding_moment(case.hertz, FRICTION)
    for share in (1e-6, 0.5, 0.99):
        follow(problem(poisson), [at(FORCE), at(FORCE, 0.0, 0.0, share * moment)], cells=33)
    with pytest.raises(InfeasibleLoad):
        follow(problem(poisson), [at(FORCE), at(FORCE, 0.0, 0.0, 1.05 * moment)], cells=33)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_loads_that_are_not_finite_are_refused(bad: float) -> None:
    for make in (lambda: at(FORCE, bad), lambda: moved(FORCE, 0.0, bad, 0.0), lambda: StepLoad(1.0, duration=bad)):
        with pytest.raises(InvalidInput):
            make()
    with pytest.raises(InvalidInput, match="normal force"):
        follow(problem(), [at(bad)])
    with pytest.raises(InvalidInput, match="three"):
        StepLoad(1.0, tangential=np.zeros(2))


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_friction_that_is_not_finite_is_refused(bad: float) -> None:
    constant = lambda *where: np.full_like(where[0], bad)  # noqa: E731
    for given in ("friction_fields", "pressure_laws", "velocity_laws"):
        with pytest.raises(InvalidInput, match="friction coefficient"):
            follow(problem(**{given: (constant,)}), [at(FORCE), at(FORCE, 1.0)])
