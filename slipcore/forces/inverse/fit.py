"""Traction on a known support, with its covariance: Bayesian regression by QR, which squares no condition number."""

from dataclasses import dataclass
from operator import itemgetter
from typing import Any

import numpy as np
import scipy.linalg

from slipcore.forces.defaults import FIT
from slipcore.forces.inverse.covariance import covariance_root, posterior, posterior_operator, solve_root
from slipcore.forces.inverse.nearby_strength import TriangularResponse
from slipcore.forces.inverse.prior import Smoothness, choices, factors, usual
from slipcore.forces.inverse.strength import Criterion, Spectrum
from slipcore.forces.operator.nodes import Nodes
from slipcore.frames import BoolArray, FloatArray


@dataclass(frozen=True, slots=True)
class TractionPrior:
    """Its shape, and its ``strength``: the standard deviation of pressure, in Young's moduli."""

    smoothness: Smoothness
    strength: float


@dataclass(frozen=True, slots=True, eq=False)
class ObservationModel:
    """How a frame's data come from traction in Young's moduli: ``response`` [m, 3, k], and ``noise`` [m] of each."""

    response: FloatArray
    noise: FloatArray

    def whitened(self, nodes: BoolArray) -> FloatArray:
        """The response [m, 3, j] of some nodes, the j chosen ones, divided by the noise."""
        return np.asarray(np.take(self.response, np.flatnonzero(nodes), axis=2) / self.noise[:, None, None])

    def within(self, nodes: BoolArray, data: FloatArray) -> tuple["ObservationModel", FloatArray]:
        """The same of some nodes alone, and data [m]: in no more than these have tractions, each of noise 1."""
        response, reached = condensed(self.whitened(nodes), data / self.noise)
        whole = np.zeros((len(reached), 3, len(nodes)))
        whole[:, :, nodes] = response
        return ObservationModel(whole, np.ones(len(reached))), reached

    def on(self, nodes: BoolArray) -> tuple[FloatArray, FloatArray]:
        """Q [m, r] and R [r, 3, j] of the whitened response of some nodes, the j chosen ones."""
        used = self.whitened(nodes).reshape(len(self.noise), -1)
        q, r = scipy.linalg.qr(used, mode="economic", check_finite=False)
        return np.asarray(q), np.asarray(r.reshape(len(r), 3, -1))

    def condition(self, nodes: BoolArray) -> float:
        """Of the whitened response of some nodes; infinite where data are fewer than tractions."""
        _, r = self.on(nodes)
        square = r.reshape(len(r), -1)
        return float(np.linalg.cond(square)) if np.isfinite(self.noise).sum() >= square.shape[1] else np.inf


@dataclass(frozen=True, slots=True, eq=False)
class TractionMean:
    """Mean of the tractions (q_x, q_y, p) at the ``support`` [j] nodes, for any data of one observation: by an
    ``operator`` [3 j, m].
    """

    support: BoolArray
    operator: FloatArray

    def mean(self, data: FloatArray) -> FloatArray:
        """Mean tractions [3, j] given data [m], whether or not they pull."""
        return np.asarray((self.operator @ data).reshape(3, -1))


@dataclass(frozen=True, slots=True, eq=False)
class TractionFit(TractionMean):
    """Their whole posterior: ``root`` [3 j, 3 j] times its transpose is its covariance; ``prior_root`` [3, j, j] the
    same before any data.
    """

    root: FloatArray
    prior_root: FloatArray

    def traction(self, mean: FloatArray) -> FloatArray:
        """The most probable tractions [3, j] that pull no more than ``FIT.tension`` allows, given their ``mean`` [3, j]
        whether or not they pull.

        A quadratic programme, solved by active sets: pressures below the bound are conditioned on lying at it, and
        freed again where they would push.
        """
        mean = mean.ravel()
        first = len(mean) * 2 // 3
        pressure = self.root[first:]
        excess = mean[first:] + FIT.tension * max(float(mean[first:].max()), 0.0)
        held, change = np.zeros(len(excess), dtype=bool), np.zeros(len(mean))
        for _ in range(FIT.rounds):
            wrong = (excess + change[first:] < -FIT.rounding * np.abs(excess).max()) & ~held
            if held.any():
                wrong[np.flatnonzero(held)[_push(pressure[held], excess[held]) > 0.0]] = True
            if not wrong.any():
                break
            held ^= wrong
            change = -self.root @ _least(pressure[held], excess[held])
        return np.asarray(mean + change).reshape(3, -1)

    def deviation(self, of: FloatArray) -> FloatArray:
        """Standard deviations [3, e] of linear combinations [e, j] of the tractions along each axis."""
        return np.stack([np.linalg.norm(of @ part, axis=-1) for part in self.root.reshape(3, -1, self.root.shape[1])])

    def averaging(self, response: FloatArray) -> FloatArray:
        """How true tractions are averaged in those found by data of this ``response`` [m, 3 j]: shear along its own
        axis (the mean of both), and pressure, [2, j, j].
        """
        x, y, normal = self._along_each_axis(response)
        return np.stack((0.5 * (x + y), normal))

    def information(self) -> FloatArray:
        """Share [3] of what is known of the resultant along each axis that comes from the data, not the prior."""
        whole = np.ones((1, self.prior_root.shape[1]))
        before = np.linalg.norm(whole @ self.prior_root, axis=(-2, -1))
        return np.asarray(np.maximum(1.0 - (self.deviation(whole)[:, 0] / before) ** 2, 0.0))

    def kernel_width(self, observation: ObservationModel, pitch: float) -> float:
        """Side (m) of the square over which tractions are in effect averaged: the median over nodes, of the worse of
        tangential and normal direction.
        """
        response = observation.response[:, :, self.support].reshape(len(observation.noise), -1)
        widths = []
        for row in self._along_each_axis(response):
            squared = np.sum(row**2, axis=1)
            known = squared > 0.0
            cells = np.sum(row, axis=1)[known] ** 2 / squared[known]
            widths.append(float(np.sqrt(np.median(cells))) if known.any() else np.inf)
        return pitch * max(1.0, *widths)

    def _along_each_axis(self, response: FloatArray) -> list[FloatArray]:
        """How much of true traction along an axis is taken up in that found along the same, [j, j] each."""
        parts = zip(np.split(self.operator, 3), np.split(response, 3, axis=1), strict=True)
        return [operator @ along for operator, along in parts]


def fit(observation: ObservationModel, nodes: Nodes, support: BoolArray, prior: TractionPrior) -> TractionFit:
    """The posterior on a ``support`` [k] under a known prior."""
    q, r = observation.on(support)
    root = prior.strength * factors_on(nodes, support, prior.smoothness)
    of_covariance, to_mean = (_unwhitened(root, part) for part in posterior(times(r, root)))
    return TractionFit(support, to_mean @ q.T / observation.noise, of_covariance, root)


def mean_traction(
    observation: ObservationModel, data: FloatArray, nodes: Nodes, support: BoolArray, prior: TractionPrior
) -> FloatArray:
    """Mean tractions [3, j] by data [m] under a known prior, whether or not they pull, without an operator for others:
    L Wᵀ (1 + W Wᵀ)⁻¹ d.
    """
    response, reached = condensed(observation.whitened(support), data / observation.noise)
    root = prior.strength * factors_on(nodes, support, prior.smoothness)
    whitened = times(response, root)
    of_data = covariance_root(whitened)
    explained = whitened.T @ solve_root(of_data, solve_root(of_data, reached, transposed=True))
    return _unwhitened(root, explained[:, None]).reshape(3, -1)


def fit_mean(observation: ObservationModel, nodes: Nodes, support: BoolArray, prior: TractionPrior) -> TractionMean:
    """Its mean alone, at a fraction of the cost and of the memory where data are fewer than tractions."""
    root = prior.strength * factors_on(nodes, support, prior.smoothness)
    whitened = times(observation.whitened(support), root)
    return TractionMean(support, _unwhitened(root, posterior_operator(whitened)) / observation.noise)


def condensed(response: FloatArray, data: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The same problem in no more data than it has unknowns, by QR: without the part of the data that none reaches."""
    m, _, k = response.shape
    if m <= 3 * k:
        return response, data
    both = np.column_stack((response.reshape(m, 3 * k), data))
    upper = scipy.linalg.qr(both, mode="r", overwrite_a=True, check_finite=False)[0][: 3 * k]
    return np.asarray(upper[:, :-1].reshape(3 * k, 3, k)), np.asarray(upper[:, -1])


def log_evidence(
    observation: ObservationModel,
    data: FloatArray,
    nodes: Nodes,
    support: BoolArray,
    shape: Smoothness,
    near: TractionPrior | None = None,
    worth: float = -np.inf,
) -> tuple[float, TractionPrior]:
    """Log probability of data [m] if traction acts on a ``support`` [k], without what no support changes: under the
    prior of this shape with the strength that makes it largest, and that prior.

    Supports are compared each by its own strength: the same force on fewer nodes takes a greater pressure on each, so
    that the strength of a wide contact would speak against all smaller ones. ``near``: the most probable prior of a
    support or a shape that differs little, from which it is found in less time, and only roughly if it is not
    ``worth`` so much.
    """
    response, seen = observation.whitened(support), data / observation.noise
    if near is not None:
        whitened = times(response, factors_on(nodes, support, shape))
        return _nearby(TriangularResponse.of(whitened, seen), shape, near, worth)
    response, reached = condensed(response, seen)
    spectrum = Spectrum.of(times(response, factors_on(nodes, support, shape)), reached)
    strength = spectrum.choose(0.0, len(reached), "evidence")
    return spectrum.log_evidence(strength) + 0.5 * float(spectrum.y @ spectrum.y), TractionPrior(shape, strength)


def _nearby(
    response: TriangularResponse, shape: Smoothness, near: TractionPrior, worth: float = -np.inf
) -> tuple[float, TractionPrior]:
    """The same from a shear as strong as that of a prior nearby, for shear is what data show best."""
    strength, log_probability = response.best(near.strength * near.smoothness.shear / shape.shear, worth)
    return log_probability, TractionPrior(shape, strength)


def choose_prior(
    observation: ObservationModel,
    data: FloatArray,
    nodes: Nodes,
    support: BoolArray,
    criterion: Criterion = "evidence",
    first: Smoothness | None = None,
) -> TractionPrior:
    """The prior that data [m] speak for: its shape by evidence, property by property; its strength by a criterion.

    ``first``: the shape to begin with (None: the usual one).
    """
    begun = choose_strength(observation, data, nodes, support, usual() if first is None else first, "evidence")
    _, prior = most_probable(observation, data, nodes, support, begun)
    if criterion == "evidence":
        return prior
    return choose_strength(observation, data, nodes, support, prior.smoothness, criterion)


def choose_strength(
    observation: ObservationModel,
    data: FloatArray,
    nodes: Nodes,
    support: BoolArray,
    shape: Smoothness,
    criterion: Criterion,
) -> TractionPrior:
    """A prior of a known shape with the strength that data [m] speak for by a criterion, of all that may be."""
    seen = data / observation.noise
    response, reached = condensed(observation.whitened(support), seen)
    rest, count = max(float(seen @ seen - reached @ reached), 0.0), int(np.isfinite(observation.noise).sum())
    spectrum = Spectrum.of(times(response, factors_on(nodes, support, shape)), reached)
    return TractionPrior(shape, spectrum.choose(rest, count, criterion))


def most_probable(
    observation: ObservationModel, data: FloatArray, nodes: Nodes, support: BoolArray, near: TractionPrior
) -> tuple[float, TractionPrior]:
    """Log probability of data [m] by the most probable prior, as ``log_evidence`` has it, and that prior: from one
    ``near`` it, property by property. A shear smaller than any that data may choose is kept.
    """
    response, seen = observation.whitened(support), data / observation.noise
    m, _, j = response.shape
    triangular = TriangularResponse.of(response.reshape(m, 3 * j), seen) if m > 3 * j else None

    def judged(shape: Smoothness, near: TractionPrior, worth: float = -np.inf) -> tuple[float, TractionPrior]:
        root = factors_on(nodes, support, shape)
        if triangular is not None:
            return _nearby(triangular.times(root), shape, near, worth)
        return _nearby(TriangularResponse.of(times(response, root), seen), shape, near, worth)

    evidence, prior = judged(near.smoothness, near)
    for name, values in choices().items():
        for value in () if name == "shear" and prior.smoothness.shear < min(values) else values:
            changed: dict[str, Any] = {name: value}
            other = prior.smoothness._replace(**changed)
            if other != prior.smoothness:
                evidence, prior = max((evidence, prior), judged(other, prior, evidence), key=itemgetter(0))
    return evidence, prior


def factors_on(nodes: Nodes, support: BoolArray, shape: Smoothness) -> FloatArray:
    """``factors`` [3, j, j] of a prior of this ``shape`` at the nodes of a ``support`` [k], of which j are."""
    places = nodes.places()
    rim = places[nodes.beside(support)] if shape.falls else None
    return factors(places[support], nodes.grid.pitch[0], shape, rim)


def times(r: FloatArray, root: FloatArray) -> FloatArray:
    """R [r, 3, j] times a block-diagonal factor [3, j, j], as [r, 3 j]."""
    return np.concatenate([r[:, axis] @ root[axis] for axis in range(3)], axis=1)


def _unwhitened(root: FloatArray, rows: FloatArray) -> FloatArray:
    """A block-diagonal factor [3, j, j] times ``rows`` [3 j, n] of its coefficients."""
    return np.concatenate([part @ each for part, each in zip(root, np.split(rows, 3), strict=True)])


def _push(pressure: FloatArray, mean: FloatArray) -> FloatArray:
    """Multipliers of pressures that are held at zero: above it they would rather push."""
    return np.asarray(np.linalg.lstsq(pressure.T, _least(pressure, mean), rcond=None)[0])


def _least(pressure: FloatArray, mean: FloatArray) -> FloatArray:
    """The shortest change of standard normal coefficients that takes pressures of this root from their mean to zero."""
    return np.asarray(np.linalg.lstsq(pressure, mean, rcond=None)[0])
