"""How probable presses with known forces are on a gel, with where they touch sought on each.

In Young's moduli, tractions follow from the displacement by Poisson's ratio and the thickness alone; Young's modulus
is then what a known force is of the resultant in moduli, and has a closed form.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

import numpy as np

from slipcore.contact.elasticity.grid import bounding_box
from slipcore.forces.defaults import GEL, GEL_CALIBRATION
from slipcore.forces.inverse.fit import ObservationModel, TractionPrior, choose_prior, fit, log_evidence
from slipcore.forces.inverse.support import SupportCandidate, better_support, widened
from slipcore.forces.operator.gel import Gel
from slipcore.forces.operator.nodes import Nodes
from slipcore.forces.operator.response import response_matrix
from slipcore.forces.operator.uneven import UnevenLayer
from slipcore.frames import BoolArray, FloatArray

Seek = Literal["nothing", "support", "both"]
"""What of contacts is sought anew: where they are, and the priors of their tractions."""


ThicknessMap = tuple[tuple[float, ...], ...]
"""A gel's ``relative_thickness``."""


class Elasticity(NamedTuple):
    """What decides the shape of the displacement: ``closeness`` 1/m of the base is one over the thickness, 0 of a
    half-space.
    """

    poisson_ratio: float
    closeness: float

    def gel(self, young_modulus: float, marker_depth: float, relative_thickness: ThicknessMap | None = None) -> Gel:
        """Such a gel."""
        thickness = 1.0 / self.closeness if self.closeness > 0.0 else np.inf
        return Gel(young_modulus, self.poisson_ratio, thickness, marker_depth, relative_thickness)


@dataclass(frozen=True, slots=True, eq=False)
class PressData:
    """Displacements ``data`` [m] m of one press with their standard deviation ``error`` [m], and its normal ``force``
    N, NaN where it is not known, with its standard deviation as a share of it, ``tolerance``.
    """

    data: FloatArray
    error: FloatArray
    force: float
    tolerance: float


@dataclass(frozen=True, slots=True, eq=False)
class Presses:
    """Several on one sensor, whose markers lie at ``position`` [j, 2] m, ``marker_depth`` m below the surface, and are
    seen along ``axes``; tractions are sought at ``nodes``. ``rest`` [n, m, 3] m: the same markers, on the surface
    as it is, of a gel whose thickness follows a map, ``relative_thickness``.
    """

    position: FloatArray
    marker_depth: float
    axes: tuple[int, ...]
    nodes: Nodes
    each: tuple[PressData, ...]
    rest: FloatArray
    relative_thickness: ThicknessMap | None = None

    def observations(self, elasticity: Elasticity) -> list[ObservationModel]:
        """How each press's displacement comes from tractions in Young's moduli."""
        unit = GEL.young_modulus[0]  # of any modulus: the response is in proportion to one over it
        gel = elasticity.gel(unit, self.marker_depth, self.relative_thickness)
        whole = response_matrix(gel, self.nodes, self.position, UnevenLayer.of(gel, self.rest))
        seen = unit * whole[list(self.axes)].reshape(-1, 3, len(self.nodes))
        return [ObservationModel(seen, press.error) for press in self.each]


class PressContact(NamedTuple):
    """Where a press touches, [ny, nx], and the prior of its tractions."""

    support: BoolArray
    prior: TractionPrior


@dataclass(frozen=True, slots=True, eq=False)
class Modulus:
    """Logarithm of Young's modulus (Pa) given Poisson's ratio and the thickness, its standard ``deviation``, and the
    log probability of the known forces.
    """

    logarithm: float
    deviation: float
    log_probability: float


@dataclass(frozen=True, slots=True, eq=False)
class EvaluatedGel:
    """Presses on one gel: their log probability (without what no gel changes), the contacts with which it is largest,
    the normal ``resultant`` of each in N by a modulus of 1 Pa, and the mean square ``misfit`` of markers over noise.
    """

    elasticity: Elasticity
    log_probability: float
    contacts: tuple[PressContact, ...]
    modulus: Modulus
    resultant: FloatArray
    misfit: float


def first_contacts(presses: Presses, elasticity: Elasticity) -> tuple[Presses, tuple[PressContact, ...]]:
    """Where presses touch a gel of about this elasticity, and the presses with nodes about there alone."""
    found = _pressed(presses) if len(presses.axes) == 3 else _within(presses)
    box = bounding_box(widened(np.any(found, axis=0), GEL_CALIBRATION.margin))
    near = replace(presses, nodes=Nodes(presses.nodes.grid.part(box)))
    contacts = []
    for press, support, observation in zip(presses.each, found, near.observations(elasticity), strict=True):
        prior = choose_prior(observation, press.data, near.nodes, support[box].ravel())
        contacts.append(PressContact(support[box], prior))
    return near, tuple(contacts)


def _pressed(presses: Presses) -> list[BoolArray]:
    """Nodes [ny, nx] whose markers are pressed in by a share of the largest depth, for each press."""
    places = presses.nodes.places()
    nearest = np.argmin(np.hypot(*(places[:, None] - presses.position[None]).transpose(2, 0, 1)), axis=1)
    depths = [np.where(press.error < np.inf, press.data, 0.0)[-len(presses.position) :] for press in presses.each]
    pressed = [depth[nearest] >= GEL_CALIBRATION.pressed * depth.max() for depth in depths]
    return [widened(each.reshape(presses.nodes.grid.shape), 1) for each in pressed]


def _within(presses: Presses) -> list[BoolArray]:
    """Nodes [ny, nx] within the circle on which markers move most sideways, as they do at the rim of a round body."""
    places, found = presses.nodes.places(), []
    for press in presses.each:
        moved = np.hypot(*np.where(press.error < np.inf, press.data, 0.0).reshape(2, -1))
        middle = moved**2 @ presses.position / np.sum(moved**2)
        most = moved >= np.quantile(moved, GEL_CALIBRATION.still)
        radius = np.mean(np.hypot(*(presses.position[most] - middle).T))
        found.append((np.hypot(*(places - middle).T) <= radius).reshape(presses.nodes.grid.shape))
    return found


def evaluate_gel(
    presses: Presses,
    elasticity: Elasticity,
    contacts: Sequence[PressContact],
    young_modulus: float | None,
    seek: Seek = "nothing",
) -> EvaluatedGel:
    """Presses on a gel, with these contacts or with what is sought about them: better ones, and priors for them."""
    found, probability, yields, misfits = [], 0.0, [], []
    for press, contact, observation in zip(presses.each, contacts, presses.observations(elasticity), strict=True):
        if seek != "nothing":
            contact = _better(observation, press.data, presses.nodes, contact, seek)
        of_press, contact = _as_strong(observation, press.data, presses.nodes, contact)
        found.append(contact)
        probability += of_press
        total, deviation, misfit = _resultant(observation, press.data, presses.nodes, contact)
        yields.append((total, deviation))
        misfits.append(misfit)
    known = np.array([(press.force, press.tolerance) for press in presses.each])
    modulus = _modulus(np.array(yields), known, young_modulus)
    probability += modulus.log_probability
    return EvaluatedGel(elasticity, probability, tuple(found), modulus, np.array(yields)[:, 0], float(np.mean(misfits)))


def _better(
    observation: ObservationModel, data: FloatArray, nodes: Nodes, contact: PressContact, seek: Seek
) -> PressContact:
    """A contact that explains a press better."""
    support, prior = contact
    everything = (observation, data, nodes)
    for _ in range(1 if seek == "support" else GEL_CALIBRATION.alternations):
        if seek == "both":
            prior = choose_prior(*everything, support.ravel(), first=prior.smoothness)
        first = SupportCandidate(support, *log_evidence(*everything, support.ravel(), prior.smoothness))
        before, support = support, better_support(*everything, first)[0].support
        if (before == support).all():
            break
    return PressContact(support, prior)


def _as_strong(
    observation: ObservationModel, data: FloatArray, nodes: Nodes, contact: PressContact
) -> tuple[float, PressContact]:
    """A press's log probability with tractions as strong as it is under this gel, and the contact with these: how
    strong is no reason to prefer one.
    """
    probability, prior = log_evidence(observation, data, nodes, contact.support.ravel(), contact.prior.smoothness)
    return probability, PressContact(contact.support, prior)


def _resultant(
    observation: ObservationModel, data: FloatArray, nodes: Nodes, contact: PressContact
) -> tuple[float, float, float]:
    """Normal resultant (N, by a modulus of 1 Pa), its standard deviation, and the mean square misfit."""
    support = contact.support.ravel()
    posterior = fit(observation, nodes, support, contact.prior)
    traction = posterior.operator @ data
    residual = (data - observation.response[:, :, support].reshape(len(data), -1) @ traction) / observation.noise
    seen = max(int(np.isfinite(observation.noise).sum()), 1)
    pressure = traction.reshape(3, -1)[2]
    deviation = float(posterior.deviation(np.ones((1, len(pressure))))[2, 0])
    total = float(pressure.sum())
    own = GEL_CALIBRATION.resultant_error * abs(total)
    return nodes.area * total, nodes.area * float(np.hypot(deviation, own)), float(residual @ residual / seen)


def _modulus(yields: FloatArray, forces: FloatArray, known: float | None) -> Modulus:
    """Young's modulus by the ratios of known ``forces`` [i, 2], with their tolerances, to resultants [i, 2], with their
    deviations; all by logarithms.
    """
    of_forces = np.isfinite(forces[:, 0])
    total, deviation = yields[of_forces].T
    force, tolerance = forces[of_forces].T
    size = np.maximum(np.abs(total), np.finfo(float).tiny)
    ratio = np.log(force / size)
    variance = (deviation / size) ** 2 + tolerance**2
    weight = 1.0 / variance
    if known is None:
        logarithm, own = float(weight @ ratio / weight.sum()), float(weight.sum() ** -0.5)
    else:
        logarithm, own = float(np.log(known)), 0.0
    probability = -0.5 * float(weight @ (ratio - logarithm) ** 2 + np.sum(np.log(variance)))
    return Modulus(logarithm, own, probability + (float(np.log(own)) if known is None else 0.0))
