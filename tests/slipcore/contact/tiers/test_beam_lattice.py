"""The beam tier against the paper's beams, its own reference and boundary elements."""

from dataclasses import replace

import numpy as np
import pytest

from slipcore.contact import simulate
from slipcore.contact.effects import ElasticObject, FiniteLayer, NormalTangentialCoupling, Viscoelasticity
from slipcore.contact.elasticity.grid import Grid
from slipcore.contact.elasticity.influence import HalfSpace
from slipcore.contact.elasticity.operator import ElasticOperator
from slipcore.contact.plan.plan import Effect
from slipcore.contact.reference.beam_chain import BeamLattice
from slipcore.contact.scene import Scene
from slipcore.contact.tiers import beam_lattice, boundary_elements
from slipcore.contact.tiers.accuracy import difference
from slipcore.contact.tiers.beam_lattice import Beams
from slipcore.contact.tiers.boundary_elements import Fidelity
from slipcore.contact.tiers.choice import cheapest, named
from slipcore.errors import InvalidInput


def test_its_compliance_is_that_of_the_papers_beams() -> None:
    """Forces on tips far from the ends of a finite lattice of springs, solved exactly."""
    pitch, bending, tie = 0.7e-3, 60.0, 30.0
    grid = Grid((31, 41), (pitch, pitch))
    traction = np.zeros((2, *grid.shape))
    traction[:, 14:17, 18:22] = np.random.default_rng(2).normal(size=(2, 3, 4))
    beams = Beams((HalfSpace(1e6, 0.3),), bending / pitch**2, tie)
    moved = ElasticOperator((beams,), grid).tangential(traction)
    force = np.moveaxis(traction, 0, -1).swapaxes(0, 1) * pitch**2
    expected = BeamLattice((41, 31), pitch, bending, tie).displacement(force)
    # a tip's pull falls by 5 a beam: the ends are 14 beams away
    np.testing.assert_allclose(
        moved, np.moveaxis(expected.swapaxes(0, 1), -1, 0), rtol=0.0, atol=1e-9 * np.abs(expected).max()
    )


def test_beams_keep_the_bodies_normal_compliance_and_have_no_coupling() -> None:
    grid, body = Grid.square(8, 4e-3), HalfSpace(1e6, 0.2)
    beams = Beams((body,), 1e8, 100.0)
    np.testing.assert_array_equal(beams.influence("nn", grid), body.influence("nn", grid))
    for component in ("xy", "zx", "zy"):
        assert beams.influence(component, grid) is None


def test_beams_are_found_again_from_what_beams_do() -> None:
    plan = Scene.from_toml("table1_condition1").plan()
    beams = Beams(plan.problem.finger, 9e7, 300.0)
    found = beam_lattice.fitted(replace(plan, problem=replace(plan.problem, finger=(beams,))))
    # the fit is of cells, where the field at the contact's edge goes on beyond it
    assert found.bending == pytest.approx(beams.bending, rel=1e-6)
    assert found.tie == pytest.approx(beams.tie, rel=1e-6)


@pytest.mark.parametrize("name", ["table1_condition1", "table1_condition4", "fig9_object1", "household_spanner"])
def test_it_is_as_accurate_as_it_says(name: str) -> None:
    scene = Scene.from_toml(name)
    plan = scene.plan()
    log, fine = beam_lattice.run(scene, plan), boundary_elements.run(plan, Fidelity(cells=24))
    assert difference(log, fine).largest <= beam_lattice.accuracy(scene, plan)
    assert log.force is not None
    # loads are carried whatever the model: forces add up as in the finer run
    np.testing.assert_allclose(
        log.force.sum(axis=(1, 2)),
        fine.force.sum(axis=(1, 2)),
        rtol=0.0,
        atol=1e-8 * np.abs(fine.force).sum(axis=(1, 2)).max(),
    )


@pytest.mark.parametrize(
    "effect",
    [ElasticObject(1e6, 0.3), NormalTangentialCoupling(), Viscoelasticity((0.1,), (1.0,))],
    ids=lambda effect: type(effect).__name__,
)
def test_it_knows_nothing_of_what_beams_do_not_have(effect: Effect) -> None:
    base = Scene.from_toml("table1_condition1")
    scene = Scene("test", (*base.effects, effect), friction=base.friction, press=base.press, duration=base.duration)
    assert beam_lattice.accuracy(scene, scene.plan()) is None
    with pytest.raises(InvalidInput, match="tier"):
        simulate(scene, tier="beams")


def test_it_stands_for_a_layer_too() -> None:
    base = Scene.from_toml("table1_condition1")
    scene = Scene("test", (*base.effects, FiniteLayer(3e-3)), press=base.press, duration=base.duration)
    thin, thick = beam_lattice.fitted(scene.plan()), beam_lattice.fitted(base.plan())
    assert thin.bending > 1.5 * thick.bending


def test_it_is_taken_where_little_is_asked_or_by_name() -> None:
    scene = Scene.from_toml("table1_condition4")  # a twist, which has no closed form here
    plan = scene.plan()
    assert cheapest(scene, plan, 0.6) is beam_lattice
    assert cheapest(scene, plan, 0.1) is None
    assert simulate(scene, tier="beams").metadata["tier"] == "beams"
    assert simulate(scene, fidelity=None, tier="boundary elements").metadata["tier"] == "boundary elements"


def test_an_unknown_tier_is_refused_by_name() -> None:
    scene = Scene.from_toml("table1_condition1")
    with pytest.raises(InvalidInput, match="finite elements"):
        named("finite elements", scene, scene.plan())


def test_a_tier_that_is_not_as_accurate_as_asked_is_refused() -> None:
    scene = Scene.from_toml("table1_condition1")
    with pytest.raises(InvalidInput, match=r"0\.01"):
        simulate(scene, tier="beams", accuracy=0.01)
    assert named("beams", scene, scene.plan(), 0.6) is beam_lattice
