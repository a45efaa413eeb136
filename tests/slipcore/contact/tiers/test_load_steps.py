"""Load steps between frames: where they end, and what that is worth."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from slipcore.contact.effects import (
    FiniteLayer,
    LoadPath,
    NormalTangentialCoupling,
    ObjectMotion,
    SensorSampling,
    TangentialLoad,
)
from slipcore.contact.plan.description import Finger
from slipcore.contact.scene import Press, Scene
from slipcore.contact.tiers.accuracy import difference
from slipcore.contact.tiers.boundary_elements import Fidelity, run
from slipcore.contact.tiers.load_steps import LoadSteps
from slipcore.contact.tiers.probe import probe

GROWTH = 0.1
SLIDING = 0.4 * 8.0
SHEARED = Scene("sheared", (TangentialLoad((1.0, 0.0), start=1.0, duration=1.0),), press=Press(8.0, 1.0))


def steps_of(scene: Scene) -> LoadSteps:
    plan = scene.plan()
    return LoadSteps(plan, probe(plan))


def between(scene: Scene, begin: float, end: float, substeps: int = 1, growth: float = GROWTH) -> np.ndarray:
    return steps_of(scene).between(begin, end, substeps, growth)


def loaded(path: LoadPath) -> Scene:
    """Pressed with 8 N within a second, and loaded."""
    return replace(SHEARED, effects=(path,), duration=path.time[-1])


def radii(scene: Scene, times: np.ndarray) -> np.ndarray:
    """Of the contact as a share of its largest."""
    plan = scene.plan()
    return np.cbrt([plan.value("normal_force", float(time)) / plan.largest_force() for time in times])


def test_steps_are_equal_where_nothing_moves_sideways_while_pressing() -> None:
    times = between(SHEARED, 0.0, 1.0, 4)
    np.testing.assert_allclose(times, [0.0, 0.25, 0.5, 0.75, 1.0], rtol=1e-15)


def test_a_load_that_bends_ends_a_step() -> None:
    scene = replace(SHEARED, effects=(LoadPath((0.0, 0.3, 2.0), force_x=(0.0, 0.0, 1.0)),))
    assert 0.3 in between(scene, 0.25, 0.5, 1, 10.0)


def test_steps_of_pressing_are_of_equal_radius_where_pressing_shears() -> None:
    scene = replace(SHEARED, effects=(*SHEARED.effects, NormalTangentialCoupling()))
    grown = np.diff(radii(scene, between(scene, 0.0, 0.5)))
    np.testing.assert_allclose(grown, 0.5 ** (1 / 3) / 8, rtol=1e-9)  # 0.79 in eight steps of at most 0.1


def test_no_step_grows_the_contact_too_far_while_the_object_is_pulled() -> None:
    """The load on both from the begin, and a release of the press, in which stick shrinks."""
    path = LoadPath((0.0, 1.0, 2.0), force_x=(0.0, 1.0, 1.0), normal_force=(0.0, 0.0, -5.0))
    scene = replace(SHEARED, effects=(path,))
    frames = np.linspace(0.0, 2.0, 5)
    steps = [between(scene, begin, end) for begin, end in pairwise(frames)]
    for times in steps:
        assert (np.diff(times) > 0.0).all()
        assert np.diff(radii(scene, times)).max() <= GROWTH * (1.0 + 1e-9)
    assert [len(times) for times in steps] == [9, 4, 2, 3]


@pytest.mark.parametrize(
    ("path", "share"),
    [
        (LoadPath((1.0, 2.0), force_x=(0.0, 0.9 * SLIDING)), 1.0),
        (LoadPath((1.0, 2.0), force_x=(0.0, 0.54 * SLIDING), force_y=(0.0, -0.72 * SLIDING)), 1.0),
        (LoadPath((0.5, 1.0, 2.0), force_x=(0.0, 0.9 * SLIDING, -0.9 * SLIDING)), 1.0),  # half of twice the share
        (LoadPath((0.5, 1.0, 2.0), force_x=(0.0, 0.9 * SLIDING, 0.0)), 0.5),
        (LoadPath((0.5, 1.0, 1.5, 2.0), force_x=(0.0, 0.9 * SLIDING, 0.9 * SLIDING, 0.0)), 0.5),  # held between
    ],
)
def test_the_edge_of_stick_moves_evenly_and_no_farther_than_that(path: LoadPath, share: float) -> None:
    """Cattaneo, Mindlin; Mindlin and Deresiewicz where the load turns back."""
    scene = loaded(path)
    times = between(scene, path.time[-2], 2.0)
    left = np.cbrt(1.0 - share * 0.9 * (times - times[0]) / (times[-1] - times[0]))
    moves = -np.diff(left) / 2.0  # of the largest width
    assert moves.max() <= GROWTH
    assert len(moves) == np.ceil((1.0 - left[-1]) / 2.0 / GROWTH)
    np.testing.assert_allclose(moves, moves.mean(), rtol=1e-9)


def test_a_moment_counts_by_how_close_to_sliding_it_is() -> None:
    """A sphere slides under 3π/16 μ F_N a."""
    plan = SHEARED.plan()
    contact = probe(plan)
    assert contact.friction == pytest.approx(0.4, rel=1e-12)
    assert contact.lever == pytest.approx(3.0 * np.pi / 16.0 * contact.reach, rel=0.04)  # the reach is found to that
    pulled = between(loaded(LoadPath((1.0, 2.0), force_x=(0.0, 0.9 * SLIDING))), 1.0, 2.0)
    twisted = between(loaded(LoadPath((1.0, 2.0), moment=(0.0, 0.9 * SLIDING * contact.lever))), 1.0, 2.0)
    np.testing.assert_allclose(twisted, pulled, rtol=1e-9)


def test_a_grip_that_loosens_under_a_load_does_it_in_steps_of_equal_stick() -> None:
    path = LoadPath((1.0, 1.5, 2.0), force_x=(0.0, 1.0, 1.0), normal_force=(0.0, 0.0, -5.0))
    times = between(loaded(path), 1.5, 2.0, growth=0.02)
    left = np.cbrt((8.0 - 10.0 * (times - 1.5) - 1.0 / 0.4) / 8.0)
    np.testing.assert_allclose(np.diff(left), np.diff(left).mean(), rtol=1e-9)
    assert len(times) > 6


def test_steps_stay_even_where_stick_does_not_shrink() -> None:
    """A grip that tightens, one that loosens without a load, and an object that is moved, whose load is not known."""
    tightens = LoadPath((1.0, 1.5, 2.0), force_x=(0.0, 1.0, 1.0), normal_force=(0.0, 0.0, 20.0))
    loosens = LoadPath((1.0, 2.0), normal_force=(0.0, -7.9))
    for effect in (tightens, loosens, ObjectMotion((1.0, 2.0), x=(0.0, 1e-3))):
        scene = replace(SHEARED, effects=(effect,), duration=2.0)
        assert len(between(scene, 1.5, 2.0, 1, 1e-3)) == 2


def test_without_friction_steps_are_even() -> None:
    scene = replace(SHEARED, friction=0.0, effects=())
    assert len(between(scene, 0.0, 1.0)) == 2


def test_growths_are_those_between_frames_and_bends_while_the_object_is_pulled() -> None:
    path = LoadPath((0.0, 0.3, 1.0, 2.0), force_x=(0.0, 0.0, 0.0, 0.9 * SLIDING))
    scene = replace(SHEARED, effects=(NormalTangentialCoupling(), path))
    radius = radii(scene, np.array([0.0, 0.3, 0.5, 1.0]))
    left = np.cbrt(1.0 - 0.9 * np.array([0.0, 0.5, 1.0]))
    grown = steps_of(scene).growths(np.array([0.0, 0.5, 1.0, 1.5, 2.0]))
    np.testing.assert_allclose(grown, [*np.diff(radius), *-np.diff(left) / 2.0], rtol=1e-9)


LOOP = LoadPath((0.5, 1.1, 1.7, 2.3), force_x=(0.0, 3.4, -3.4, 3.4))
GRIP = LoadPath((0.5, 0.8, 1.1, 1.4, 1.7), force_x=(0.0, 1.6, 1.6, 1.6, 1.6), normal_force=(0.0, 0.0, -5.5, 0.0, -5.5))


def orders(scene: Scene, cells: int) -> tuple[float, float]:
    """Of displacement and force at the sensor's points, between one and four steps of six frames a pull."""
    plan = replace(scene, effects=(*scene.effects, SensorSampling((12, 12), 1e-3, 10.0))).plan()
    fine = run(plan, Fidelity(cells, 12, 1e-6, aligned=False))
    coarse, fair = (run(plan, Fidelity(cells, substeps, 1e-6, aligned=False)) for substeps in (1, 4))
    growth = np.log(int(fair.metadata["steps"]) / int(coarse.metadata["steps"]))
    errors = [difference(log, fine) for log in (coarse, fair)]
    return tuple(
        float(np.log(getattr(errors[0], of) / getattr(errors[1], of)) / growth) for of in ("displacement", "force")
    )


@pytest.mark.parametrize("path", [LOOP, GRIP])
def test_loops_close_to_sliding_are_of_higher_order_in_the_steps_of_a_scene(path: LoadPath) -> None:
    """Even steps came to 1.3 and to 0.9."""
    scene = Scene("loop", (path,), Finger(poisson_ratio=0.45), press=Press(10.0, 0.5), duration=path.time[-1])
    assert min(orders(scene, 32)) >= 1.5


@pytest.mark.long
@pytest.mark.parametrize("path", [LOOP, GRIP, LoadPath((0.0, 0.5), normal_force=(0.0, 0.0))])
def test_pressing_and_loops_on_a_bonded_layer_are_of_higher_order(path: LoadPath) -> None:
    effects = (path, FiniteLayer(5e-3), NormalTangentialCoupling())
    scene = Scene("loop", effects, Finger(poisson_ratio=0.49), press=Press(10.0, 0.5), duration=path.time[-1])
    assert min(orders(scene, 32)) >= 1.5


@pytest.mark.long
def test_a_bonded_layer_is_converged_in_its_default_steps() -> None:
    """60 steps of first order were off by 0.096, 4.2e-3 and 6.1e-3."""
    plan = Scene.from_toml("table1_condition1_layer").plan()
    log = run(plan)
    found = difference(log, run(plan, Fidelity(substeps=16, tolerance=1e-5)))
    assert int(log.metadata["steps"]) <= 100
    assert found.stick_ratio <= 0.01
    assert found.displacement <= 2e-4
    assert found.force <= 4e-4


def test_a_bonded_layer_is_pressed_in_default_steps_as_in_ever_finer_ones() -> None:
    """With one step a frame the stick ratio was off by 0.10 and displacement by 4e-3."""
    scene = Scene.from_toml("table1_condition1_layer")
    plan = replace(scene, duration=scene.press.duration).plan()
    found = difference(run(plan, Fidelity(16, 1)), run(plan, Fidelity(16, 8)))
    assert found.stick_ratio <= 0.05
    assert found.displacement <= 1e-3
