"""Histories of load against closed forms."""

import time

import numpy as np
import pytest

from slipcore.contact.elasticity.grid import Grid
from slipcore.contact.elasticity.influence import HalfSpace
from slipcore.contact.errors import InfeasibleLoad
from slipcore.contact.reference.cattaneo_mindlin import CattaneoMindlin
from slipcore.contact.reference.mindlin_deresiewicz import MindlinDeresiewicz
from slipcore.contact.solver.problem import ContactProblem, MaxwellBranch, StepLoad
from slipcore.contact.solver.quasi_static import QuasiStatic
from slipcore.contact.solver.step_equations import StepEquations

FRICTION, RADIUS, FORCE, YOUNG = 0.4, 15e-3, 10.0, 1e6
SLIDING = FRICTION * FORCE


def sphere_on(poisson: float, **more) -> ContactProblem:
    heights = (lambda x, y: (x**2 + y**2) / (2.0 * RADIUS),)
    return ContactProblem((HalfSpace.from_young(YOUNG, poisson),), FRICTION, heights=heights, **more)


def shear(normal: float, along_x: float, moment: float = 0.0, duration: float = 1.0) -> StepLoad:
    return StepLoad(normal, tangential=np.array([along_x, 0.0, moment]), duration=duration)


def test_press_shear_reverse_and_release_follow_mindlin_and_deresiewicz(sphere) -> None:
    case = sphere(64)
    solver = QuasiStatic(sphere_on(0.0), case.grid)
    exact = MindlinDeresiewicz(case.hertz, FRICTION)
    r = np.hypot(*case.grid.points())
    largest = np.sqrt((exact.load(FORCE, 3.5).traction(r) ** 2).sum())
    state, _ = solver.step(solver.start(), shear(FORCE, 0.0))
    for force in (1.0, 2.0, 3.0, 3.5, 2.0, 0.0, -2.0, -3.5, 0.0, 2.5):
        state, result = solver.step(state, shear(FORCE, force))
        exact = exact.load(FORCE, force)
        assert np.sqrt(((state.stress.traction[0] - exact.traction(r)) ** 2).sum()) <= 0.02 * largest
        assert result.pose[0] == pytest.approx(exact.rigid_displacement, abs=2e-4 * abs(solver.height).max())
        assert result.imbalance <= 1e-10
    state, result = solver.step(state, shear(0.0, 0.0))
    assert not result.contact.any()
    assert not result.displacement.any()
    assert np.isnan(result.stick_ratio)


def test_raising_the_normal_force_freezes_the_traction_of_an_uncoupled_half_space() -> None:
    solver = QuasiStatic(sphere_on(0.49), Grid.square(48, 14e-3))
    state, _ = solver.step(solver.start(), shear(5.0, 0.0))
    state, before = solver.step(state, shear(5.0, 1.6))
    state, after = solver.step(state, shear(10.0, 1.6))
    np.testing.assert_allclose(after.force[:2], before.force[:2], rtol=0.0, atol=1e-4 * before.force[0].max())
    assert not after.moved.any()
    assert after.stick_ratio == 1.0


def test_a_stop_stops_slip_and_a_reversal_sticks_everywhere_at_once() -> None:
    solver = QuasiStatic(sphere_on(0.3), Grid.square(48, 11e-3))
    state, _ = solver.step(solver.start(), shear(FORCE, 0.0))
    for force in (1.0, 2.0, 3.0):
        state, loading = solver.step(state, shear(FORCE, force))
    assert loading.moved.any()
    state, hold = solver.step(state, shear(FORCE, 3.0))
    assert not hold.moved.any()
    assert hold.at_limit.any()  # contact factor and motion are two truths
    _, back = solver.step(state, shear(FORCE, 2.9))
    assert back.moved.sum() < 0.05 * back.contact.sum()


def test_stick_ratio_is_that_of_cattaneo_and_mindlin(sphere) -> None:
    case = sphere(64)
    solver = QuasiStatic(sphere_on(0.0), case.grid)
    state, _ = solver.step(solver.start(), shear(FORCE, 0.0))
    for share in (0.2, 0.5, 0.8):
        state, result = solver.step(state, shear(FORCE, share * SLIDING))
        exact = CattaneoMindlin(case.hertz, FRICTION, share * SLIDING)
        assert result.stick_ratio == pytest.approx(exact.stick_ratio, abs=0.01)


def test_infeasible_loads_are_refused_and_the_state_before_stays_good() -> None:
    solver = QuasiStatic(sphere_on(0.3), Grid.square(32, 11e-3))
    state, _ = solver.step(solver.start(), shear(FORCE, 0.0))
    with pytest.raises(InfeasibleLoad):
        solver.step(state, shear(FORCE, 1.5 * SLIDING))
    assert solver.step(state, shear(FORCE, 0.5 * SLIDING))[1].imbalance <= 1e-10


def test_creep_reaches_the_relaxed_solution_and_starts_from_the_glassy_one() -> None:
    grid, branch = Grid.square(48, 14e-3), MaxwellBranch(strength=0.8, time=1.0)
    glassy = QuasiStatic(sphere_on(0.5), grid)
    relaxed = QuasiStatic(
        ContactProblem((HalfSpace.from_young(YOUNG / 1.8, 0.5),), FRICTION, heights=sphere_on(0.5).heights), grid
    )
    creeping = QuasiStatic(sphere_on(0.5, creep=(branch,)), grid)
    state, first = creeping.step(creeping.start(), shear(FORCE, 0.0, duration=1e-9))
    expected = glassy.step(glassy.start(), shear(FORCE, 0.0))[1]
    np.testing.assert_allclose(first.displacement, expected.displacement, rtol=0.0, atol=1e-6 * first.approach)
    for _ in range(30):
        state, last = creeping.step(state, shear(FORCE, 0.0, duration=1.0))
    expected = relaxed.step(relaxed.start(), shear(FORCE, 0.0))[1]
    np.testing.assert_allclose(last.displacement, expected.displacement, rtol=0.0, atol=1e-6 * last.approach)


def test_coupling_presses_the_surface_sideways_and_balances() -> None:
    solver = QuasiStatic(sphere_on(0.2, coupled=True), Grid.square(40, 11e-3))
    state, result = solver.step(solver.start(), shear(FORCE, 0.0))
    assert np.abs(result.force[:2]).max() > 0.02 * FRICTION * result.force[2].max()
    np.testing.assert_allclose(result.force[:2].sum(axis=(1, 2)), 0.0, atol=1e-10 * FORCE)
    np.testing.assert_allclose(result.force[0], -result.force[0, :, ::-1], rtol=0.0, atol=1e-3 * result.force[0].max())
    _, sheared = solver.step(state, shear(FORCE, 2.0))
    assert sheared.force[0].sum() == pytest.approx(2.0, rel=1e-10)


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.49])
def test_pressure_and_traction_of_coupled_steps_agree_with_each_other(poisson: float) -> None:
    """One more pass of either leaves the other as it is: the fixed point is reached, not merely slow."""
    loads = [shear(FORCE, force) for force in np.linspace(0.0, 3.6, 10)]
    grid = Grid.square(40, 11e-3)
    loose, tight = (
        list(QuasiStatic(sphere_on(poisson, coupled=True), grid, tolerance).run(loads))[-1]
        for tolerance in (1e-3, 1e-7)
    )
    size = np.linalg.norm(tight.force[2])
    # tolerances are shares of what a step changes, a tenth of the capacity; errors of ten steps add up
    assert np.linalg.norm(loose.force[2] - tight.force[2]) <= 1e-3 * size
    assert np.linalg.norm(loose.force[:2] - tight.force[:2]) <= 5e-3 * FRICTION * size


def test_a_step_under_unchanged_pressing_leaves_normal_contact_alone() -> None:
    solver = QuasiStatic(sphere_on(0.3), Grid.square(32, 11e-3))
    state, _ = solver.step(solver.start(), shear(FORCE, 0.0))
    state, sheared = solver.step(state, shear(FORCE, 1.0))
    assert sheared.applications.normal == 0
    _, pressed = solver.step(state, shear(1.1 * FORCE, 1.0))
    assert pressed.applications.normal > 0


def test_velocity_dependent_friction_meets_its_own_law() -> None:
    solver = QuasiStatic(sphere_on(0.3, velocity_laws=(lambda v: 2.0 * v,)), Grid.square(32, 11e-3), tolerance=1e-7)
    state, _ = solver.step(solver.start(), shear(FORCE, 0.0))
    load = StepLoad(FORCE, motion=np.array([2e-3, 0.0, 0.0]), given=(False, False, False), duration=0.1)
    _, result = solver.step(state, load)
    sliding = result.moved & result.contact
    ratio = np.hypot(*result.force[:2])[sliding] / result.force[2][sliding]
    velocity = np.hypot(*result.slip)[sliding] / 0.1
    np.testing.assert_allclose(ratio, FRICTION + 2.0 * velocity, rtol=1e-5)


def test_steady_sliding_under_velocity_dependent_friction_is_known_from_the_step_before() -> None:
    solver = QuasiStatic(sphere_on(0.49, velocity_laws=(lambda v: 10.0 * v,)), Grid.square(32, 11e-3), tolerance=1e-4)
    state, _ = solver.step(solver.start(), shear(FORCE, 0.0))
    pulled = StepLoad(FORCE, motion=np.array([1e-4, 0.0, 0.0]), given=(False, True, True), duration=1.0 / 30.0)
    applications = []
    for _ in range(40):
        state, result = solver.step(state, pulled)
        applications.append(result.applications.tangential)
    assert result.sliding
    assert applications[-1] <= 15  # without a memory of the speed 167


def test_slip_that_goes_on_is_that_of_the_cells_that_slide_alone() -> None:
    """An annulus of them, in a contact in the middle of a grid: what sticks or does not touch has no slip at all."""
    solver = QuasiStatic(sphere_on(0.3), Grid.square(32, 14e-3))
    state, _ = solver.step(solver.start(), shear(FORCE, 0.0))
    for force in (0.6 * SLIDING, 0.8 * SLIDING):
        state, result = solver.step(state, shear(FORCE, force))
    slides = state.slip.any(axis=0)
    assert 0 < slides.sum() < result.contact.sum()
    assert (result.at_limit[slides]).all()
    assert not slides[~result.contact].any()
    np.testing.assert_array_equal(state.slip[:, slides], result.slip[:, slides])


def test_a_step_tells_how_long_it_took() -> None:
    solver, begin = QuasiStatic(sphere_on(0.0), Grid.square(16, 14e-3)), time.perf_counter()
    told = [result.seconds for result in solver.run([shear(FORCE, 0.0), shear(FORCE, 1.0)])]
    assert min(told) > 0.0
    assert sum(told) <= time.perf_counter() - begin


def test_slip_is_looked_for_only_where_the_bodies_touch(monkeypatch: pytest.MonkeyPatch) -> None:
    """A small contact on a large grid costs as a small grid does."""
    boxes, slide = [], StepEquations._slide

    def noted(self, normal, box, *rest):
        boxes.append((normal.pressure > 0.0, box))
        return slide(self, normal, box, *rest)

    monkeypatch.setattr(StepEquations, "_slide", noted)
    list(QuasiStatic(sphere_on(0.0), Grid.square(64, 40e-3)).run([shear(FORCE, 0.0), shear(FORCE, 1.0)]))
    for touches, box in boxes:
        assert touches[box].sum() == touches.sum() > 0
        assert touches[box].size < 4 * touches.sum()


def test_bodies_apart_bear_no_load_and_nothing_has_moved() -> None:
    state = QuasiStatic(sphere_on(0.3), Grid.square(8, 11e-3)).start()
    assert (state.load.normal_force, state.load.approach) == (0.0, None)
    assert not any(np.any(field) for field in (state.load.tangential, state.load.motion, state.stress.pressure))


def test_only_a_body_that_touches_and_bears_no_more_slides() -> None:
    solver = QuasiStatic(sphere_on(0.3), Grid.square(16, 11e-3))
    state, pressed = solver.step(solver.start(), shear(FORCE, 0.0))
    pulled = StepLoad(FORCE, motion=np.array([1e-2, 0.0, 0.0]), given=(False, False, False), duration=1.0)
    _, moved = solver.step(state, pulled)
    _, lifted = solver.step(state, shear(0.0, 0.0))
    assert (pressed.sliding, moved.sliding, lifted.sliding) == (False, True, False)


def test_what_is_written_to_a_result_does_not_reach_the_next_step() -> None:
    solver = QuasiStatic(sphere_on(0.3), Grid.square(24, 11e-3))
    state, result = solver.step(solver.start(), shear(FORCE, 0.0))
    _, wanted = solver.step(state, shear(FORCE, 1.0))
    for field in (result.displacement, result.force, result.limit, result.slip, result.pose):
        field[:] = np.nan
    _, found = solver.step(state, shear(FORCE, 1.0))
    np.testing.assert_array_equal(found.displacement, wanted.displacement)
    np.testing.assert_array_equal(found.force, wanted.force)
    np.testing.assert_array_equal(found.pose, wanted.pose)
