"""Compiled kernels against the same loops interpreted, and against numpy."""

import importlib
import pkgutil

import numpy as np
import pytest

from slipcore import GraspLog, detect_slip, detection
from slipcore.contact import RampSchedule, tangential_ramp
from slipcore.detection.methods import METHODS
from slipcore.detection.shared.contact import curvature
from slipcore.detection.strain_rate.reference import surface_normal, surface_strain
from slipcore.detection.strain_rate.step import surface_strains
from slipcore.element_forces import element_forces
from slipcore.surface.normals import split_forces, surface_normals
from slipcore.surface.strain import Lattice, lattice_steps


def short_log() -> GraspLog:
    schedule = RampSchedule(0.1, 0.2, 0.1, 0.5, 0.1)
    return tangential_ramp(points=6, pitch=2e-3, schedule=schedule, marker_noise=1e-6, force_noise=2e-3)


@pytest.mark.parametrize("method", ["filter", "strain_rate"])
def test_kernels_interpreted_say_the_same_as_compiled(method: str, monkeypatch: pytest.MonkeyPatch) -> None:
    log = short_log()
    compiled = detect_slip(log, method)
    modules = [
        importlib.import_module(m.name) for m in pkgutil.walk_packages(detection.__path__, "slipcore.detection.")
    ]
    for module in modules:
        for name, member in vars(module).copy().items():
            if hasattr(member, "py_func"):
                monkeypatch.setattr(module, name, member.py_func)
        if hasattr(module, "unpack"):  # exists in compiled code only
            monkeypatch.setattr(module, "unpack", lambda array, size: tuple(array[:size]))
        if hasattr(module, "borrowed"):
            monkeypatch.setattr(module, "borrowed", lambda value: value)
        if hasattr(module, "call_at"):
            monkeypatch.setattr(module, "address_of", lambda kernel, *_: kernel)
            monkeypatch.setattr(module, "call_at", lambda kernel, _, given: kernel(*given))
    monkeypatch.setitem(METHODS, method, METHODS[method]._replace(run=METHODS[method].run.py_func))
    interpreted = detect_slip(log, method)
    np.testing.assert_allclose(
        interpreted.probability, compiled.probability, rtol=1e-9, atol=1e-12
    )  # fused multiply-adds
    for name in ("contact", "slip", "macro_slip"):
        np.testing.assert_array_equal(getattr(interpreted, name), getattr(compiled, name))
    np.testing.assert_allclose(interpreted.velocity, compiled.velocity, rtol=1e-9, atol=1e-15)


def test_surface_and_forces_are_those_of_numpy() -> None:
    log = short_log()
    lattice, displacement, force = Lattice.at_rest(log.position), log.displacement[-1], log.force[-1]
    normal, pressing, tangential = np.empty((6, 6, 3)), np.empty((6, 6)), np.empty((6, 6))
    surface_normals(lattice.steps, lattice.orientation, displacement, normal)
    steps = lattice_steps(displacement)
    np.testing.assert_allclose(normal, surface_normal(lattice, steps), rtol=1e-12, atol=1e-15)
    strain = surface_strains(lattice.inverse_jacobian, displacement, normal)
    np.testing.assert_allclose(strain, surface_strain(lattice, steps, normal), rtol=1e-9, atol=1e-15)
    split_forces(force, normal, pressing, tangential)
    split = element_forces(force, normal)
    np.testing.assert_allclose(np.abs(pressing), split.normal, rtol=1e-12, atol=1e-18)
    np.testing.assert_array_equal(pressing > 0.0, split.compressive)
    np.testing.assert_allclose(tangential, split.tangential, rtol=1e-9, atol=1e-15)  # f − (f·n) n cancels


def test_the_curvature_of_a_paraboloid_is_constant_inside() -> None:
    x, y = np.meshgrid(np.arange(7.0), np.arange(9.0), indexing="ij")
    np.testing.assert_allclose(curvature(x**2 + 0.5 * y**2)[2:-2, 2:-2], 3.0, rtol=1e-12)
