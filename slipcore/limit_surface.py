"""The loads that friction can carry: the limit surface of a contact (Goyal, Ruina, Papadopoulos 1991).

A load (F_x, F_y, M) can be carried if and only if no rigid sliding motion would let it do more work than friction
everywhere takes up: load·d ≤ σ(d) = Σ R_i |B_i d| for every d.
"""

import math
from typing import NamedTuple

import numpy as np

from slipcore.compilation import compiled
from slipcore.frames import BoolArray, FloatArray


class LimitLoad(NamedTuple):
    """``factor`` by which a load may grow until all slides, and the ``motion`` [3] (direction) of that sliding."""

    factor: float
    motion: FloatArray


class Descent(NamedTuple):
    """When the search ends: after so many ``descents``, or by less than ``settled`` as a share. ``still``: share of the
    fastest motion under which a point counts as its centre; ``rank``: least polar moment of the weights about their
    centre, as a share of that about the origin; ``free_motion``: share of a load that may be missed before a motion
    meets no friction.
    """

    descents: int
    settled: float
    still: float
    rank: float
    free_motion: float


class Planar(NamedTuple):
    """A load (F_x, F_y, M), or a motion (v_x, v_y, ω)."""

    x: float
    y: float
    turn: float


class Weights(NamedTuple):
    """Of friction in a motion: their ``total``, their centre (x, y), 0 along an axis whose motion is held, and their
    polar moment about that centre, 0 where only rounding is left of it.
    """

    total: float
    x: float
    y: float
    polar: float


@compiled
def find_limit_load(
    radius: FloatArray, arm: FloatArray, load: FloatArray, given: BoolArray, descent: Descent
) -> LimitLoad:
    """How far ``load`` [3] is from the limit surface of disks of ``radius`` [n] at ``arm`` [2, n].

    Where a component's motion is held instead of its load, it takes part in no sliding. The factor is infinite
    without load. Minimises σ(d) subject to load·d = 1 by iteratively reweighted least squares, which only descends.
    """
    held = np.where(given, load, 0.0)
    if not held.any():
        return LimitLoad(np.inf, np.zeros(3))
    target, weight = Planar(held[0], held[1], held[2]), np.empty(radius.size)
    factor, motion, least = np.inf, _scaled(target, target), descent.free_motion * np.abs(held).max()
    for _ in range(descent.descents):
        taken = _friction(radius, arm, motion, descent.still, weight)
        if taken >= factor * (1.0 - descent.settled):
            break
        factor, weights = taken, _weights(weight, arm, given, descent.rank)
        moment = _moment(weights, target) if given[2] else 0.0
        if weights.total == 0.0 or (weights.polar == 0.0 and abs(moment) > least):
            factor = 0.0  # some motion meets no friction, such as rotation about a single cell
            break
        motion = _scaled(_answer(weights, target, moment), target)
    return LimitLoad(factor, np.array([motion.x, motion.y, motion.turn]))


@compiled
def _scaled(motion: Planar, load: Planar) -> Planar:
    """The motion at which the load takes up power 1."""
    power = load.x * motion.x + load.y * motion.y + load.turn * motion.turn
    return Planar(motion.x / power, motion.y / power, motion.turn / power)


@compiled
def _friction(radius: FloatArray, arm: FloatArray, motion: Planar, still: float, weight: FloatArray) -> float:
    """What friction takes up in a sliding motion, σ, and each disk's ``weight`` [n] in Σ w |B d|², which equals it."""
    taken, slowest = 0.0, still * max(abs(motion.x), abs(motion.y), abs(motion.turn))
    for i in range(radius.size):
        speed = math.hypot(motion.x - arm[1, i] * motion.turn, motion.y + arm[0, i] * motion.turn)
        taken += radius[i] * speed
        weight[i] = radius[i] / max(speed, slowest)
    return taken


@compiled
def _weights(weight: FloatArray, arm: FloatArray, given: BoolArray, rank: float) -> Weights:
    """Taken about their own centre: about the origin, moments of far points would cancel."""
    total = x = y = polar = about_origin = 0.0
    for i in range(weight.size):
        total += weight[i]
        x += weight[i] * arm[0, i]
        y += weight[i] * arm[1, i]
    x, y = x / total if given[1] else 0.0, y / total if given[0] else 0.0
    for i in range(weight.size):
        polar += weight[i] * ((arm[0, i] - x) ** 2 + (arm[1, i] - y) ** 2)
        about_origin += abs(weight[i]) * (arm[0, i] ** 2 + arm[1, i] ** 2)
    return Weights(total, x, y, polar if abs(polar) > rank * about_origin else 0.0)


@compiled
def _moment(weights: Weights, load: Planar) -> float:
    """Of a load, about the centre of the weights."""
    return load.turn - weights.x * load.y + weights.y * load.x


@compiled
def _answer(weights: Weights, load: Planar, moment: float) -> Planar:
    """The motion d that minimises ½ Σ w |B d|² − load·d: translation of the weights' centre, and rotation about it."""
    spin = moment / weights.polar if weights.polar != 0.0 else 0.0
    return Planar(load.x / weights.total + weights.y * spin, load.y / weights.total - weights.x * spin, spin)
