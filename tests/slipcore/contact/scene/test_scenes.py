"""Every scene of the library runs, carries its loads and has the shape that its sensor asks for."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from slipcore.contact.plan.plan import Plan
from slipcore.contact.reference.cattaneo_mindlin import CattaneoMindlin
from slipcore.contact.reference.elastic_pair import half_space
from slipcore.contact.reference.hertz import HertzContact
from slipcore.contact.scene import LIBRARY, Scene, library
from slipcore.contact.tiers import boundary_elements
from slipcore.contact.tiers.boundary_elements import Fidelity
from slipcore.frames import FloatArray, GraspLog

CHEAP = Fidelity(cells=14, substeps=1, tolerance=1e-3)
FRAMES = 6
FULLY_SLIDING = {"cycle_0200um", "cycle_0400um", "cycle_0600um", "cycle_0800um", "cycle_1000um"}
NEARLY_SLIDING = {"table1_condition1", "table1_condition1_layer", "table1_condition2", "table1_condition3"}
"""At 99.4 % of the sliding force: on a coarse grid no cell may be left that sticks."""


def cheaply(name: str) -> Plan:
    """The plan of a scene, seen a few times only."""
    plan = Scene.from_toml(name).plan()
    assert plan.sampling is not None
    return replace(plan, sampling=replace(plan.sampling, frame_rate=FRAMES / plan.duration))


@cache
def run(name: str) -> GraspLog:
    return boundary_elements.run(cheaply(name), CHEAP)


def test_the_library_has_what_the_paper_shows_and_a_dozen_household_objects() -> None:
    names = library()
    for prefix, count in (("table1_condition", 4), ("fig9_object", 6), ("fig10", 1), ("cycle", 5), ("lifting", 5)):
        assert sum(name.startswith(prefix) for name in names) >= count, prefix
    assert sum(name.startswith("household") for name in names) >= 12
    assert {"cup_filling", "bottle_cap_twist"} <= set(names)


@pytest.mark.parametrize("name", library())
def test_every_scene_says_what_it_shows(name: str) -> None:
    scene = Scene.from_toml(name)
    assert scene.name
    assert scene.description
    assert len((LIBRARY / f"{name}.toml").read_text(encoding="utf-8").splitlines()) < 75


@pytest.mark.parametrize("name", library())
def test_every_scene_runs_and_balances(name: str) -> None:
    plan = cheaply(name)
    log = run(name)
    assert log.displacement.shape == (FRAMES + 1, *plan.sampling.points, 3)
    assert log.truth.contact.any()
    total = log.force.sum(axis=(1, 2))
    largest = max(plan.value("normal_force", float(t)) for t in log.time)
    pressed = [-plan.value("normal_force", float(t)) for t in log.time]
    np.testing.assert_allclose(total[:, 2], pressed, rtol=0.0, atol=1e-6 * largest)
    for axis, channel in enumerate(("force_x", "force_y")):
        if not plan.drives(("motion_x", "motion_y")[axis]):
            carried = [plan.value(channel, float(t)) for t in log.time]
            np.testing.assert_allclose(total[:, axis], carried, rtol=0.0, atol=1e-6 * largest)


@pytest.mark.parametrize("name", sorted(set(library()) - FULLY_SLIDING - NEARLY_SLIDING))
def test_grips_hold_to_the_end(name: str) -> None:
    ratio = run(name).truth.stick_ratio
    assert 0.1 < ratio[-1] < 1.0
    assert ratio[np.isfinite(ratio)][0] > 0.9  # all sticks before it is loaded


def test_the_harder_the_grip_the_more_sticks() -> None:
    ratios = [run(f"lifting_{f:02d}N").truth.stick_ratio[-1] for f in (7, 8, 10, 12, 15)]
    assert ratios == sorted(ratios)


def test_a_normal_force_that_rises_sticks_the_contact_again() -> None:
    scene = Scene.from_toml("fig10_normal_force_rises")
    log = boundary_elements.run(scene.plan(), Fidelity(cells=24, tolerance=1e-3))
    sheared, pressed, again = (int(np.argmin(abs(log.time - t))) for t in (1.0, 4 / 3, 2.0))
    ratio = log.truth.stick_ratio
    assert ratio[sheared] < 0.1
    assert ratio[pressed] > 0.9
    assert ratio[again] < ratio[pressed] - 0.2


def test_condition_1_is_cattaneo_and_mindlin_within_what_poissons_ratio_bends() -> None:
    scene = Scene.from_toml("table1_condition1")
    log = boundary_elements.run(scene.plan(), Fidelity(cells=40))
    hertz = HertzContact(scene.finger.radius, 10.0, half_space(scene.finger.young_modulus, scene.finger.poisson_ratio))

    def exact(force: float) -> float:
        return CattaneoMindlin(hertz, scene.friction, force).stick_ratio

    loads: FloatArray = log.force[..., 0].sum(axis=(1, 2))
    sheared = loads > 0.2
    np.testing.assert_allclose(
        log.truth.stick_ratio[sheared], [exact(float(f)) for f in loads[sheared]], rtol=0.0, atol=0.03
    )
