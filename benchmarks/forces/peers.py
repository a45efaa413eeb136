"""What a lab would try first to find forces from displacement, and what others found, in one form.

Linear operators that are made once for a sensor: the plain pseudo-inverse, Tikhonov's with one fixed parameter, and a
ridge regression from displacements to forces that knows no mechanics. The parameters of the last two are chosen on
presses that no table reports. Others' reconstructions come and go as `.npz`.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, lru_cache
from pathlib import Path

import numpy as np
import scipy.linalg

from benchmarks.forces.scenes import CONTACTS, Lattice, Truth, press, seen
from slipcore import GraspLog
from slipcore.forces import Gel
from slipcore.forces.operator.nodes import Nodes
from slipcore.forces.operator.response import response_matrix
from slipcore.frames import FloatArray

OUTWARD = np.array([1.0, 1.0, -1.0])
TRAINING_NOISE, TRAINING_PRESSES = 3e-6, 40
"""Noise (m) for which the fixed parameters are chosen, and presses of three frames each on which they are."""


@dataclass(frozen=True, slots=True, eq=False)
class Linear:
    """Forces [3 j] on elements (x, y, into the gel) from displacements [m] along the axes that are seen."""

    operator: FloatArray
    with_depth: bool

    def forces(self, log: GraspLog) -> FloatArray:
        """[t, n, m, 3] N."""
        found = flat(log.displacement, self.with_depth) @ self.operator.T
        return np.asarray(np.moveaxis(found.reshape(len(log), 3, *log.grid), 1, -1) * OUTWARD)


def flat(field: FloatArray, with_depth: bool) -> FloatArray:
    """A field [t, n, m, 3] as rows of x, then y, then (with depth) what goes into the gel: [t, m]."""
    inwards = np.moveaxis(field * OUTWARD, -1, 1)[:, : 3 if with_depth else 2]
    return np.asarray(inwards.reshape(len(field), -1))


Maker = Callable[[Gel, Lattice, bool], Linear]


def pseudo_inverse(gel: Gel, lattice: Lattice, with_depth: bool) -> Linear:
    """The least tractions at the markers' own nodes that explain the displacement best, to rounding."""
    response, elements = _response(gel, lattice, with_depth)
    return Linear(elements @ np.linalg.pinv(response), with_depth)


def tikhonov(gel: Gel, lattice: Lattice, with_depth: bool) -> Linear:
    """The same, with one parameter: the decade's third that errs least on the training presses."""
    response, elements = _response(gel, lattice, with_depth)
    u, s, vt = scipy.linalg.svd(response, full_matrices=False)
    moved, force = training(gel, lattice, with_depth)
    errors, operators = [], []
    for parameter in s[0] * np.logspace(-6, 0, 19):
        operators.append(elements @ ((vt.T * (s / (s**2 + parameter**2))) @ u.T))
        errors.append(np.linalg.norm(moved @ operators[-1].T - force))
    return Linear(operators[int(np.argmin(errors))], with_depth)


def ridge(gel: Gel, lattice: Lattice, with_depth: bool) -> Linear:
    """Ridge regression from displacements to forces; its parameter errs least when each press is left out once."""
    moved, force = training(gel, lattice, with_depth)
    u, s, vt = scipy.linalg.svd(moved, full_matrices=False)
    best, least = np.zeros((force.shape[1], moved.shape[1])), np.inf
    for parameter in s[0] * np.logspace(-6, 0, 19):
        share = s**2 / (s**2 + parameter**2)
        residual = (force - (u * share) @ (u.T @ force)) / (1.0 - np.sum(u**2 * share, axis=1))[:, None]
        if (error := float(np.linalg.norm(residual))) < least:
            best, least = ((vt.T * (share / s)) @ (u.T @ force)).T, error
    return Linear(best, with_depth)


PEERS: dict[str, Maker] = {"pseudo-inverse": pseudo_inverse, "fixed Tikhonov": tikhonov, "ridge regression": ridge}


@lru_cache(maxsize=2)
def _response(gel: Gel, lattice: Lattice, with_depth: bool) -> tuple[FloatArray, FloatArray]:
    """Displacement [m, 3 j] and elements' forces [3 j, 3 j] by traction at the nodes under the markers."""
    x, y = (lattice.pitch * (np.arange(n) - 0.5 * (n - 1)) for n in lattice.shape)
    position = np.stack([axis.ravel() for axis in np.meshgrid(x, y, indexing="ij")], axis=-1)
    nodes = Nodes.around(position, lattice.pitch**2)
    under = np.argmin(np.linalg.norm(nodes.places()[:, None] - position, axis=-1), axis=0)
    axes = 3 if with_depth else 2
    response = response_matrix(gel, nodes, position)[:axes, :, :, under]
    elements: FloatArray = np.kron(np.eye(3), nodes.over_elements(position)[:, under])
    return response.reshape(axes * len(position), 3 * len(position)), elements


@lru_cache(maxsize=1)
def presses(gel: Gel, lattice: Lattice) -> list[GraspLog]:
    """Presses without noise, anywhere on the lattice, of all contacts."""
    rng = np.random.default_rng(17)
    reach = 0.25 * lattice.pitch * np.array(lattice.shape)
    chosen = [(str(contact), *rng.uniform(-reach, reach)) for contact in rng.choice(list(CONTACTS), TRAINING_PRESSES)]
    return [press(contact, gel, lattice, (float(x), float(y))).log for contact, x, y in chosen]


def training(gel: Gel, lattice: Lattice, with_depth: bool) -> tuple[FloatArray, FloatArray]:
    """Noisy displacements [p, m] and forces [p, 3 j] of presses that no table reports."""
    rng = np.random.default_rng(18)
    shown = [seen(log, TRAINING_NOISE, with_depth, rng) for log in presses(gel, lattice)]
    moved = np.concatenate([flat(log.displacement, with_depth) for log in shown])
    return moved, np.concatenate([flat(log.force, with_depth=True) for log in shown if log.force is not None])


@cache
def made(name: str, gel: Gel, lattice: Lattice, with_depth: bool) -> tuple[Linear, float]:
    """A peer's operator, and the seconds of CPU that it took."""
    began = time.process_time()
    return PEERS[name](gel, lattice, with_depth), time.process_time() - began


def export(log: GraspLog, truth: Truth, gel: Gel, path: Path) -> None:
    """Write what another method needs: SI units, z outward, the gel, and the true total of normal force."""
    np.savez(
        path,
        time=log.time,
        position=log.position,
        displacement=log.displacement,
        element_area=log.element_area,
        young_modulus=gel.young_modulus,
        poisson_ratio=gel.poisson_ratio,
        thickness=gel.thickness,
        marker_depth=gel.marker_depth,
        total_force=-truth.total[:, 2],
    )


def imported(path: Path, log: GraspLog) -> FloatArray:
    """Forces [t, n, m, 3] N, z outward, that another method wrote as ``force``."""
    with np.load(path) as found:
        force = np.asarray(found["force"], dtype=np.float64)
    if force.shape != log.displacement.shape:
        raise SystemExit(f"{path}: force is of shape {list(force.shape)}, needed: {list(log.displacement.shape)}")
    return force
