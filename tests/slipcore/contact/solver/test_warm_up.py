"""What is loaded before anything is timed."""

from collections.abc import Callable
from typing import Any

import pytest
from numba.core.registry import CPUDispatcher

from slipcore.contact.effects import LoadPath, SensorSampling
from slipcore.contact.elasticity import fields, transform
from slipcore.contact.scene import Scene
from slipcore.contact.solver import extrapolation, normal, projection, tangential
from slipcore.contact.solver.warm_up import load_kernels
from slipcore.contact.tiers.boundary_elements import Fidelity, run

MODULES = (fields, transform, extrapolation, normal, projection, tangential)


def called_by(action: Callable[[], Any], monkeypatch: pytest.MonkeyPatch) -> set[str]:
    """Kernels, by name, that something calls from Python."""
    called: set[str] = set()
    action()  # compiles them, which those of a name that is watched could not be

    def watched(name: str, kernel: Callable[..., Any]) -> Callable[..., Any]:
        def call(*arguments: Any) -> Any:
            called.add(name)
            return kernel(*arguments)

        return call

    with monkeypatch.context() as watching:
        for module in MODULES:
            for name, kernel in list(vars(module).items()):
                if isinstance(kernel, CPUDispatcher):
                    watching.setattr(module, name, watched(f"{kernel.py_func.__module__}.{name}", kernel))
        action()
    return called


def test_every_kernel_that_a_run_calls_is_loaded(monkeypatch: pytest.MonkeyPatch) -> None:
    path = LoadPath((1.0, 1.5, 2.0), force_x=(0.0, 3.0, 0.0), moment=(0.0, 0.0, 5e-3))
    plan = Scene("turning", (path, SensorSampling((6, 6), 2e-3, 4.0))).plan()
    needed = called_by(lambda: run(plan, Fidelity(10, aligned=False)), monkeypatch)
    known = {name.rpartition(".")[2] for name in needed}
    assert {"convolve", "relaxed", "nearest_tractions", "_rounds", "_extrapolate_traction"} <= known
    assert needed <= called_by(load_kernels.__wrapped__, monkeypatch)
