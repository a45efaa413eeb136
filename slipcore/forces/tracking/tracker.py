"""The contact followed from frame to frame, and the fit of tractions on it."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import binary_propagation, generate_binary_structure
from scipy.special import softmax

from slipcore.forces.defaults import RECONSTRUCTION
from slipcore.forces.inverse.fit import (
    ObservationModel,
    TractionFit,
    TractionMean,
    TractionPrior,
    choose_prior,
    choose_strength,
    fit,
    fit_mean,
    most_probable,
)
from slipcore.forces.inverse.strength import Criterion
from slipcore.forces.inverse.support import SupportCandidate, better_support, relevant_nodes, widened
from slipcore.forces.inverse.whole_lattice import WholeLattice, whole_lattice
from slipcore.forces.tracking.sensor import SensorResponse
from slipcore.frames import BoolArray, FloatArray

EDGES_AND_CORNERS = generate_binary_structure(2, 2)


@dataclass(frozen=True, slots=True, eq=False)
class Key:
    """A frame at which the contact was sought, and the fit that holds until markers have moved on.

    ``others``: mean tractions on other contacts that data speak for, with the probabilities of these.
    """

    observation: ObservationModel
    data: FloatArray
    fit: TractionFit
    others: tuple[tuple[float, TractionMean], ...] = ()

    def holds(self, observation: ObservationModel, data: FloatArray) -> bool:
        """Whether a frame sees the same markers and differs by little more than the noise of both."""
        if len(data) != len(self.data) or ((observation.noise == np.inf) != (self.observation.noise == np.inf)).any():
            return False
        change, before = (data - self.data) / self.observation.noise, self.data / self.observation.noise
        noise = 2.0 * np.isfinite(self.observation.noise).sum()
        return bool(change @ change <= RECONSTRUCTION.change**2 * (before @ before) + noise)


@dataclass(frozen=True, slots=True, eq=False)
class Tracker:
    """The contact followed from frame to frame; ``lattice`` where depth is seen."""

    sensor: SensorResponse
    criterion: Criterion
    prior: TractionPrior
    key: Key
    lattice: WholeLattice | None

    @classmethod
    def of(
        cls,
        sensor: SensorResponse,
        observation: ObservationModel,
        data: FloatArray,
        criterion: Criterion,
        lattice: WholeLattice | None = None,
    ) -> "Tracker":
        """Begin with a frame, which chooses the prior; ``lattice``: one made before, where depth is seen."""
        nodes, count = sensor.nodes, len(sensor.response)
        everything = (observation, data, nodes)
        if not sensor.sees_depth:
            support = relevant_nodes(observation, data, np.ones(nodes.grid.shape, dtype=bool))
            prior = choose_prior(*everything, support.ravel(), first=sensor.first_shape)
            return cls._sought_in_the_plane(sensor, criterion, observation, data, support, prior)
        if lattice is None:
            noise = float(np.min(observation.noise[:count]))
            lattice = lattice_of(sensor, noise, float(np.sqrt(np.mean(data[:count] ** 2))))
        support = _pressed(sensor, lattice, observation, data)
        prior = choose_prior(*everything, support.ravel(), criterion, sensor.first_shape)
        found = fit(observation, nodes, support.ravel(), prior)
        return cls(sensor, criterion, prior, Key(observation, data, found), lattice)

    def at(self, observation: ObservationModel, data: FloatArray) -> "Tracker":
        """Go on to another frame; the contact is sought again only where markers have moved on."""
        if self.key.holds(observation, data):
            return self
        if self.lattice is None:
            before = self.key.fit.support.reshape(self.sensor.nodes.grid.shape)
            return self._sought_in_the_plane(self.sensor, self.criterion, observation, data, before, self.prior)
        support = _pressed(self.sensor, self.lattice, observation, data).ravel()
        found = fit(observation, self.sensor.nodes, support, self.prior)
        return replace(self, key=Key(observation, data, found))

    def wider(self) -> TractionMean:
        """Mean tractions on the contact with one row around it: what it may be once markers have moved on."""
        contact = self.key.fit.support.reshape(self.sensor.nodes.grid.shape)
        return fit_mean(self.key.observation, self.sensor.nodes, widened(contact, 1).ravel(), self.prior)

    @classmethod
    def _sought_in_the_plane(
        cls,
        sensor: SensorResponse,
        criterion: Criterion,
        observation: ObservationModel,
        data: FloatArray,
        before: BoolArray,
        prior: TractionPrior,
    ) -> "Tracker":
        """With a better contact for a frame than that ``before`` [ny, nx], and first the frame's own prior: one that
        allows for the shear of another frame lets shear stand for pressure, and the contact shrinks to where it would.
        """
        everything = (observation, data, sensor.nodes)
        first = SupportCandidate(before, *most_probable(*everything, before.ravel(), prior))
        best, *others = better_support(*everything, first)
        probability = softmax([each.log_probability for each in (best, *others)])
        support, prior = best.support.ravel(), best.prior
        if criterion != "evidence":
            prior = choose_strength(*everything, support, prior.smoothness, criterion)
        means = [fit_mean(observation, sensor.nodes, each.support.ravel(), each.prior) for each in others]
        found = fit(observation, sensor.nodes, support, prior)
        key = Key(observation, data, found, tuple(zip(probability[1:], means, strict=True)))
        return cls(sensor, criterion, prior, key, None)


def lattice_of(sensor: SensorResponse, noise: float, typical: float) -> WholeLattice:
    """For markers with this ``noise`` m whose displacements have the root mean square ``typical`` m."""
    everywhere = ObservationModel(sensor.response, np.full(len(sensor.response), noise))
    return whole_lattice(everywhere, sensor.nodes, typical, sensor.first_shape)


def _pressed(
    sensor: SensorResponse, lattice: WholeLattice, observation: ObservationModel, data: FloatArray
) -> BoolArray:
    """Nodes [ny, nx] with a pressure that is not noise, those beside them where depth is not seen, and one row around
    both; never none.
    """
    pressure, deviation = lattice.operator @ data[: len(sensor.response)], lattice.deviation
    noise = RECONSTRUCTION.node_significance * deviation
    least = np.maximum(noise, RECONSTRUCTION.node_share * pressure.max())
    pressed = ((pressure > least) | (pressure == pressure.max())).reshape(sensor.nodes.grid.shape)
    unseen = np.zeros_like(pressed)
    unseen.flat[sensor.elements[~sensor.depth_seen(observation)].argmax(axis=1)] = True
    return widened(np.asarray(binary_propagation(pressed, EDGES_AND_CORNERS, pressed | unseen)), 1)
