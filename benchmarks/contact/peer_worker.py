"""Runs other contact solvers in the interpreter that has them: one JSON job a line in, one JSON answer a line out.

Started by `benchmarks.contact.peers`; needs nothing of this project. Problem: a sphere on a half-space, then, where the
peer can, a tangential force in one step.
"""

import importlib
import importlib.metadata
import json
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

Job = dict[str, Any]


def height(job: Job) -> np.ndarray:
    """Gap of the sphere [cells, cells] m."""
    cells, width = job["cells"], job["width"]
    x = (np.arange(cells) - (cells - 1) / 2) * (width / cells)
    return (x[:, None] ** 2 + x**2) / (2.0 * job["radius"])


def tamaas(job: Job) -> tuple[float, float, np.ndarray, int]:
    """Polonsky and Keer's conjugate gradients with the free-space operator."""
    import tamaas as tm

    tm.set_log_level(tm.LogLevel.error)
    cells, width = job["cells"], job["width"]
    begin = time.perf_counter()
    model = tm.ModelFactory.createModel(tm.model_type.basic_2d, [width, width], [cells, cells])
    model.E, model.nu = job["modulus"], 0.0
    tm.ModelFactory.registerNonPeriodic(model, "free")
    kind = tm.PolonskyKeerRey.pressure
    solver = tm.PolonskyKeerRey(model, -height(job), job["tolerance"], kind, kind)
    solver.setIntegralOperator("free")
    ready = time.perf_counter()
    solver.solve(job["force"] / width**2)
    done = time.perf_counter()
    return ready - begin, done - ready, np.array(model.traction), -1


def contact_mechanics(job: Job) -> tuple[float, float, np.ndarray, int]:
    """The same method in Python; its tolerance is a length."""
    from ContactMechanics import FreeFFTElasticHalfSpace
    from ContactMechanics.Systems import NonSmoothContactSystem
    from SurfaceTopography import Topography

    cells, width = job["cells"], job["width"]
    begin = time.perf_counter()
    substrate = FreeFFTElasticHalfSpace((cells, cells), job["modulus"], (width, width))
    system = NonSmoothContactSystem(substrate, Topography(-height(job), (width, width)))
    ready = time.perf_counter()
    depth = job["tolerance"] * job["approach"]
    found = system.minimize_proxy(external_force=job["force"], pentol=depth, forcetol=job["tolerance"] * 1e-3)
    done = time.perf_counter()
    return ready - begin, done - ready, np.array(found.jac) / (width / cells) ** 2, int(found.nit)


def aspher(job: Job) -> tuple[float, float, np.ndarray, int]:
    """Preconditioned conjugate gradients, one grid."""
    import aspher as peer

    cells, width = job["cells"], job["width"]
    begin = time.perf_counter()
    solver = peer.ContactSolver(grid_size=cells, domain_size=width, E_star=job["modulus"], backend="fft")
    ready = time.perf_counter()
    found = solver.solve(
        height(job).ravel(), p_nominal=job["force"] / width**2, tol=job["tolerance"], precond="fourier-fft"
    )
    done = time.perf_counter()
    return ready - begin, done - ready, np.array(found.pressure).reshape(cells, cells), int(found.iterations)


def aspher_nested(job: Job) -> tuple[float, float, np.ndarray, int]:
    """The same from coarse grids to fine ones; its set-up is part of the call."""
    import aspher as peer

    cells, width = job["cells"], job["width"]
    begin = time.perf_counter()
    found = peer.solve_nested(
        grid_size=cells,
        gap=height(job).ravel(),
        p_nominal=job["force"] / width**2,
        domain_size=width,
        E_star=job["modulus"],
        coarsest=32,
        tol=job["tolerance"],
        backend="fft",
    )
    done = time.perf_counter()
    return 0.0, done - begin, np.array(found.pressure).reshape(cells, cells), int(found.iterations)


def aspher_friction(job: Job) -> tuple[float, float, np.ndarray, int]:
    """Coulomb friction: press, then one step of tangential force, which alone is timed."""
    import aspher as peer

    cells, width = job["cells"], job["width"]
    begin = time.perf_counter()
    model = peer.CoulombFriction(job["friction"])
    solver = peer.FrictionSolver(
        grid_size=cells, domain_size=width, E_star=job["modulus"], nu=job["poisson"], model=model
    )
    solver.set_gap(height(job).ravel())
    solver.step(p_bar=job["force"] / width**2, tol_normal=1e-9)
    ready = time.perf_counter()
    found = solver.step(q_bar=(job["shear"] / width**2, 0.0), tol_tangential=job["tolerance"])
    done = time.perf_counter()
    if not found.converged:
        raise RuntimeError(found.status_reason)
    return ready - begin, done - ready, np.array(found.qx).reshape(cells, cells), int(found.tangential_iters)


SOLVERS: dict[str, tuple[str, Callable[[Job], tuple[float, float, np.ndarray, int]]]] = {
    "Tamaas": ("tamaas", tamaas),
    "ContactMechanics": ("ContactMechanics", contact_mechanics),
    "ASPHER": ("aspher", aspher),
    "ASPHER nested": ("aspher", aspher_nested),
    "ASPHER friction": ("aspher", aspher_friction),
}


def available() -> dict[str, str]:
    """Versions of the peers that can be imported."""
    found = {}
    for name, (module, _) in SOLVERS.items():
        try:
            importlib.import_module(module)
        except ImportError:
            continue
        found[name] = importlib.metadata.version(module)
    return found


def answer(job: Job) -> dict[str, Any]:
    """Set-up and solution seconds, iterations; the field goes to the file named in the job."""
    if job["solver"] == "available":
        return available()
    try:
        setup, seconds, field, iterations = SOLVERS[job["solver"]][1](job)
    except Exception as error:  # whatever a peer raises is its answer
        return {"error": f"{type(error).__name__}: {error}"}
    np.save(Path(job["output"]), field)
    return {"setup": setup, "seconds": seconds, "iterations": iterations}


def main() -> None:
    """Answer until the input ends."""
    out = sys.stdout
    sys.stdout = sys.stderr  # peers print
    for line in sys.stdin:
        print(json.dumps(answer(json.loads(line))), file=out, flush=True)


if __name__ == "__main__":
    main()
