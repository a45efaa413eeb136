"""Effects of a scene, one a file. Each adds itself to the plan; absent ones cost nothing."""

from slipcore.contact.effects.drift import GelDrift
from slipcore.contact.effects.dropped_frames import DroppedFrames
from slipcore.contact.effects.elastic_object import ElasticObject
from slipcore.contact.effects.finite_layer import FiniteLayer
from slipcore.contact.effects.force_noise import ForceNoise
from slipcore.contact.effects.friction_patch import FrictionPatch
from slipcore.contact.effects.load_path import LoadPath
from slipcore.contact.effects.marker_noise import MarkerNoise
from slipcore.contact.effects.normal_tangential_coupling import NormalTangentialCoupling
from slipcore.contact.effects.object_motion import ObjectMotion
from slipcore.contact.effects.pressing_spread import PressingSpread
from slipcore.contact.effects.pressure_friction import PressureFriction
from slipcore.contact.effects.random_friction import RandomFriction
from slipcore.contact.effects.sensor_sampling import SensorSampling
from slipcore.contact.effects.surface_shape import (
    CylinderSurface,
    FlatSurface,
    MeasuredSurface,
    RingSurface,
    SphereSurface,
    WavySurface,
)
from slipcore.contact.effects.tangential_load import TangentialLoad
from slipcore.contact.effects.torsion import Torsion
from slipcore.contact.effects.velocity_friction import VelocityFriction
from slipcore.contact.effects.viscoelasticity import Viscoelasticity
from slipcore.contact.plan.plan import Effect

EFFECTS: dict[str, type[Effect]] = {
    kind.__name__: kind
    for kind in (
        CylinderSurface,
        DroppedFrames,
        ElasticObject,
        FiniteLayer,
        FlatSurface,
        ForceNoise,
        FrictionPatch,
        GelDrift,
        LoadPath,
        MarkerNoise,
        MeasuredSurface,
        NormalTangentialCoupling,
        ObjectMotion,
        PressingSpread,
        PressureFriction,
        RandomFriction,
        RingSurface,
        SensorSampling,
        SphereSurface,
        TangentialLoad,
        Torsion,
        VelocityFriction,
        Viscoelasticity,
        WavySurface,
    )
}
"""Every effect by the name that scene files use."""

__all__ = ["EFFECTS", *sorted(EFFECTS)]
