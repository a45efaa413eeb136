"""What is exported, run in Drake itself."""

from collections.abc import Callable

import numpy as np
import pytest

from stiction_client import CoulombFriction, FrictionModel, InvalidArgument, drake_friction

Make = Callable[..., FrictionModel]

FORCE = 0.1
"""N an element."""

AHEAD, UP = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])


def speed(foot: CoulombFriction, floor: CoulombFriction, pull: float) -> float:
    """m/s of a round foot after 1 s on a floor, pulled by ``pull`` of its weight, unable to turn; a discrete plant."""
    drake = pytest.importorskip("pydrake.all", reason="drake is not installed")  # takes half a second to load
    builder = drake.DiagramBuilder()
    plant, _ = drake.AddMultibodyPlantSceneGraph(builder, 1e-3)
    rail = plant.AddRigidBody("rail", drake.SpatialInertia.SolidSphereWithMass(1e-3, 0.01))
    body = plant.AddRigidBody("foot", drake.SpatialInertia.SolidSphereWithMass(1.0, 0.05))
    along = plant.AddJoint(drake.PrismaticJoint("x", plant.world_frame(), rail.body_frame(), AHEAD))
    across = plant.AddJoint(drake.PrismaticJoint("z", rail.body_frame(), body.body_frame(), UP))
    place = drake.RigidTransform()
    for part, shape, surface in ((plant.world_body(), drake.HalfSpace(), floor), (body, drake.Sphere(0.05), foot)):
        friction = drake.CoulombFriction(surface.static_friction, surface.dynamic_friction)
        plant.RegisterCollisionGeometry(part, place, shape, "contact", friction)
    plant.mutable_gravity_field().set_gravity_vector([9.81 * pull, 0.0, -9.81])
    plant.Finalize()
    simulator = drake.Simulator(builder.Build())
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    across.set_translation(context, 0.0499)
    simulator.AdvanceTo(1.0)
    return float(abs(along.get_translation_rate(context)))


def test_a_discrete_plant_holds_at_95_percent_and_slips_at_105(make_model: Make) -> None:
    """Though friction falls with velocity: such a plant knows the dynamic coefficient only."""
    model = make_model((0.41, -20.0, -0.35))
    friction = drake_friction(model, FORCE, discrete=True)
    assert friction.static_friction == friction.dynamic_friction
    assert speed(friction, friction, 0.95 * friction.static_friction) < 1e-3
    assert speed(friction, friction, 1.05 * friction.static_friction) > 0.05


def test_without_saying_so_a_discrete_plant_slips_below_static_friction(make_model: Make) -> None:
    friction = drake_friction(make_model((0.41, -20.0, -0.35)), FORCE)
    assert speed(friction, friction, 0.95 * friction.static_friction) > 0.05


@pytest.mark.parametrize("other", [0.25, 1.0])
def test_the_pair_is_right_beside_a_surface_that_is_another(make_model: Make, other: float) -> None:
    held = drake_friction(make_model(), FORCE, discrete=True).static_friction
    foot, floor = (
        drake_friction(make_model(), FORCE, discrete=True, other_friction=other),
        CoulombFriction(other, other),
    )
    assert 2.0 * foot.static_friction * other / (foot.static_friction + other) == pytest.approx(held, rel=1e-14)
    assert speed(foot, floor, 0.95 * held) < 1e-3
    assert speed(foot, floor, 1.05 * held) > 0.05


def test_a_surface_that_is_too_slippery_for_the_pair_is_refused(make_model: Make) -> None:
    with pytest.raises(InvalidArgument, match=r"other_friction is 0\.1; allowed: above 0\.1"):
        drake_friction(make_model(), FORCE, other_friction=0.1)
