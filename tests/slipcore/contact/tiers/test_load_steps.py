"""Load steps between frames: where they end, and what that is worth."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from slipcore.contact.effects import LoadPath, NormalTangentialCoupling, TangentialLoad
from slipcore.contact.scene import Press, Scene
from slipcore.contact.tiers.accuracy import difference
from slipcore.contact.tiers.boundary_elements import Fidelity, run
from slipcore.contact.tiers.load_steps import growths, load_steps

GROWTH = 0.1
SHEARED = Scene("sheared", (TangentialLoad((1.0, 0.0), start=1.0, duration=1.0),), press=Press(8.0, 1.0))


def radii(scene: Scene, times: np.ndarray) -> np.ndarray:
    """Of the contact as a share of its largest."""
    plan = scene.plan()
    return np.cbrt([plan.value("normal_force", float(time)) / plan.largest_force() for time in times])


def test_steps_are_equal_where_nothing_moves_sideways_while_pressing() -> None:
    times = load_steps(SHEARED.plan(), 0.0, 1.0, 4, GROWTH)
    np.testing.assert_allclose(times, [0.0, 0.25, 0.5, 0.75, 1.0], rtol=1e-15)


def test_a_load_that_bends_ends_a_step() -> None:
    scene = replace(SHEARED, effects=(LoadPath((0.0, 0.3, 2.0), force_x=(0.0, 0.0, 1.0)),))
    assert 0.3 in load_steps(scene.plan(), 0.25, 0.5, 1, 10.0)


def test_steps_of_pressing_are_of_equal_radius_where_pressing_shears() -> None:
    scene = replace(SHEARED, effects=(*SHEARED.effects, NormalTangentialCoupling()))
    grown = np.diff(radii(scene, load_steps(scene.plan(), 0.0, 0.5, 1, GROWTH)))
    np.testing.assert_allclose(grown, 0.5 ** (1 / 3) / 8, rtol=1e-9)  # 0.79 in eight steps of at most 0.1


def test_no_step_grows_the_contact_too_far_while_the_object_is_pulled() -> None:
    """The load on both from the begin, and a release of the press, which needs no more steps."""
    path = LoadPath((0.0, 1.0, 2.0), force_x=(0.0, 1.0, 1.0), normal_force=(0.0, 0.0, -8.0))
    scene = replace(SHEARED, effects=(path,))
    frames = np.linspace(0.0, 2.0, 5)
    steps = [load_steps(scene.plan(), begin, end, 1, GROWTH) for begin, end in pairwise(frames)]
    for times in steps:
        assert (np.diff(times) > 0.0).all()
        assert np.diff(radii(scene, times)).max() <= GROWTH * (1.0 + 1e-9)
    assert [len(times) for times in steps] == [9, 4, 2, 2]


def test_the_radius_grows_by_the_same_between_frames_and_bends_while_the_object_is_pulled() -> None:
    path = LoadPath((0.0, 0.3, 2.0), force_x=(0.0, 0.0, 1.0))
    scene = replace(SHEARED, effects=(path,))
    radius = radii(scene, np.array([0.0, 0.3, 0.5, 1.0]))
    grown = growths(scene.plan(), np.array([0.0, 0.5, 1.0, 1.5]))  # up to the bend nothing pulls
    np.testing.assert_allclose(grown, [0.0, *np.diff(radius)[1:], 0.0], rtol=1e-12, atol=1e-15, err_msg="rounding")


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
