"""Hold a box between two plates in Drake with the friction that a service has learnt, at 95 % of what it bears and 105.

stiction serve &
STICTION_URL=http://127.0.0.1:8000 python examples/hold_in_drake.py
"""

import numpy as np
from pydrake import all as drake

from slipcore.contact import tangential_ramp
from stiction_client import Contact, CoulombFriction, FrictionClient, FrictionModel, drake_friction

GRIP = 8.0
"""N with which each of the two plates presses."""
MASS = 0.5
"""kg of the box."""
CLOSED, WATCHED, END = 0.5, 0.6, 0.8
"""s at which the box is pulled, from which on its speed is measured, and at which the trial ends."""
TIME_STEP = 1e-3
"""s of the discrete plant."""

SIDE, THICK = 0.02, 0.01
"""m of the box, and of a plate."""
PLATE = Contact.flat(6e-5)  # 60 mm², about what touched in the recordings
ACROSS, DOWN = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, -1.0])


def learnt() -> FrictionModel:
    """The material's friction, from four grasps as a sensor would have seen them: μ = 0.45, give or take 0.02."""
    frictions = 0.45 + 0.02 * np.random.default_rng(7).standard_normal(4)
    with FrictionClient() as client:  # the address is that of STICTION_URL, the access key that of STICTION_KEY
        client.ensure_material("held box")
        for seed, friction in enumerate(frictions):
            sensor = {"points": 12, "pitch": 1e-3, "marker_noise": 1e-6, "force_noise": 2e-3}
            log = tangential_ramp(friction=friction, seed=seed, **sensor)
            client.wait(client.upload(log, material="held box").job).raise_for_status()
        client.wait(client.fit("held box", method="hierarchical")).raise_for_status()
        return client.model("held box", method="hierarchical")


def friction_of(model: FrictionModel) -> CoulombFriction:
    """What box and plates are given, both: a discrete plant ignores static friction, hence ``discrete``."""
    element = float(PLATE.element_force(GRIP, model.element_area))
    return drake_friction(model, element, 0.01, contact_area=float(PLATE.area), discrete=True)


def surface(friction: CoulombFriction) -> drake.ProximityProperties:
    """A compliant surface, so that faces touch by their area and not in one point."""
    found = drake.ProximityProperties()
    told = drake.CoulombFriction(friction.static_friction, friction.dynamic_friction)
    drake.AddContactMaterial(dissipation=10.0, friction=told, properties=found)
    drake.AddCompliantHydroelasticProperties(resolution_hint=SIDE, hydroelastic_modulus=1e7, properties=found)
    return found


def plant_of(friction: CoulombFriction, builder: drake.DiagramBuilder) -> drake.MultibodyPlant:
    """Two plates that are pressed along one axis, and a free box between them; without gravity, so that it is still."""
    plant, _ = drake.AddMultibodyPlantSceneGraph(builder, TIME_STEP)
    plant.mutable_gravity_field().set_gravity_vector(np.zeros(3))
    box = plant.AddRigidBody("box", drake.SpatialInertia.SolidBoxWithMass(MASS, SIDE, SIDE, SIDE))
    here = drake.RigidTransform()
    plant.RegisterCollisionGeometry(box, here, drake.Box(SIDE, SIDE, SIDE), "box", surface(friction))
    for name, towards in (("left", ACROSS), ("right", -ACROSS)):
        plate = plant.AddRigidBody(name, drake.SpatialInertia.SolidBoxWithMass(0.1, THICK, 3.0 * SIDE, 3.0 * SIDE))
        slab = drake.Box(THICK, 3.0 * SIDE, 3.0 * SIDE)
        plant.RegisterCollisionGeometry(plate, here, slab, name, surface(friction))
        rail = drake.PrismaticJoint(name, plant.world_frame(), plate.body_frame(), towards, damping=5.0)
        plant.AddJointActuator(name, plant.AddJoint(rail))
    plant.Finalize()
    return plant


def speed(friction: CoulombFriction, pull: float) -> float:
    """m/s at which the box slides, on average from ``WATCHED`` on, under a ``pull`` of N along the plates."""
    builder = drake.DiagramBuilder()
    plant = plant_of(friction, builder)
    simulator = drake.Simulator(builder.Build())
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    for name in ("left", "right"):
        plant.GetJointByName(name).set_translation(context, -0.5 * (SIDE + THICK))
    plant.get_actuation_input_port().FixValue(context, [GRIP, GRIP])
    box = plant.GetBodyByName("box")
    simulator.AdvanceTo(CLOSED)
    force = drake.ExternallyAppliedSpatialForce()
    force.body_index, force.F_Bq_W = box.index(), drake.SpatialForce(np.zeros(3), pull * DOWN)
    plant.get_applied_spatial_force_input_port().FixValue(context, drake.Value[list[type(force)]]([force]))
    heights = []
    for time in (WATCHED, END):
        simulator.AdvanceTo(time)
        heights.append(plant.EvalBodyPoseInWorld(context, box).translation()[2])
    return float(heights[0] - heights[1]) / (END - WATCHED)


def main() -> None:
    """Ask, hold, and pull too hard."""
    friction = friction_of(learnt())
    held = 2.0 * friction.dynamic_friction * GRIP
    print(f"two plates that press with {GRIP:g} N hold {held:.2f} N")
    for share in (0.95, 1.05):
        print(f"at {share:.0%} of that the box moves at {1e3 * speed(friction, share * held):.4f} mm/s")


if __name__ == "__main__":
    main()
