"""The layers that a contact has grown by, and how a tangential load lies in them: who slips, and at what friction.

A contact under a normal force F is the sum of what it grew by, layer on layer, and each layer dF bears tangential
traction D of at most the friction: q = ∫ D dp. A load that grows fills layers from the outermost inwards, one that
turns back fills them anew the other way, and what they held further in stays (Jäger, J. Tribol. 120 (1998) 677; of
spheres Mindlin and Deresiewicz, J. Appl. Mech. 20 (1953) 327). It holds for any smooth shape on a half-space. The
normal forces of elements while the contact grows are these layers as a sensor sees them, so that for each friction
both the forces of elements and what share of each still sticks follow from the sums of forces alone.
"""

import math
from typing import NamedTuple

import numpy as np

from slipcore.compilation import compiled, unpack
from slipcore.defaults import NUMERICS, CoarseOptions
from slipcore.detection.forces_only.tuning import Considered
from slipcore.frames import FloatArray

_LEAST_FORCE, _LEAST_SPREAD = NUMERICS.least_element_force, NUMERICS.least_spread
_MEAN_CHANGE = 3.0 * math.sqrt(2.0 / math.pi)
"""Of a load whose four parts change by normal noise of 1: mean length of three of them, and mean size of the last."""
REACHED, SPACING, NORMAL, X, Y, TURN, LOADS = range(7)
"""Rows of ``Layers.load``."""


class Layers(NamedTuple):
    """What is remembered of k elements at g friction coefficients.

    ``load`` [6]: how many levels the normal force has reached, their spacing, N, and the sums of forces when they were
    last looked at, N. ``level`` [levels + 1, k]: normal forces, N, of elements when it was at each. ``traction``
    [g, levels, 3]: of each layer along x and y and around the pressure centre, over pressure. ``normal`` [k] N as last
    looked at; ``odds`` [k]: log-odds of slip.
    """

    load: FloatArray
    level: FloatArray
    traction: FloatArray
    normal: FloatArray
    odds: FloatArray


class PressedElements(NamedTuple):
    """Forces on elements at ``place`` [k, 2] m: ``normal`` [k] N, 0 where nothing touches, and ``sideways`` [k, 2] N,
    with ``noise`` N of a component; ``depth`` [k] m: how far each is pressed in.
    """

    place: FloatArray
    normal: FloatArray
    sideways: FloatArray
    depth: FloatArray
    noise: float


class SummedLoad(NamedTuple):
    """Sums over the contact, N: ``normal``; along ``x`` and ``y``; and ``turn``, the moment about the pressure centre
    at ``centre_x``, ``centre_y`` m over its arm, the mean distance from there. At r from the centre a turn of 1 shares
    ``lever`` × r, 1/m.
    """

    normal: float
    x: float
    y: float
    turn: float
    centre_x: float
    centre_y: float
    lever: float


class LayerTuning(NamedTuple):
    """Options of ``coarse`` that the kernels of layers read, in the same units; see ``CoarseOptions``."""

    least_load_change: float
    load_deviations: float
    layer_misfit: float
    layer_evidence: float
    layer_stick_share: float
    layer_stick_width: float
    spring_spread: float
    largest_sum: float
    forces_weight: float
    filter_weight: float
    layers_weight: float
    many_elements: float
    few_odds: float
    few_elements: float


_TUNING = len(LayerTuning._fields)


@compiled
def layer_tuning(settings: FloatArray) -> LayerTuning:
    """The options by name, from their array."""
    return LayerTuning(*unpack(settings, _TUNING))


def no_layers(elements: int, options: CoarseOptions) -> Layers:
    """Nothing touches yet."""
    level, traction = np.zeros((options.layers + 1, elements)), np.zeros((options.frictions, options.layers, 3))
    return Layers(np.zeros(LOADS), level, traction, np.zeros(elements), np.zeros(elements))


@compiled
def look_at_layers(frame: PressedElements, kept: Layers, known: Considered) -> None:
    """Look at the layers anew once the load has changed by more than noise; writes to what is ``kept``."""
    tuning = layer_tuning(known.settings)
    now = sums(frame.place, frame.normal, frame.sideways)
    if now.normal <= _LEAST_FORCE:
        kept.load[:] = 0.0
        kept.normal[:] = 0.0
        kept.odds[:] = 0.0
        return
    if kept.load[REACHED] == 0.0:
        begin(kept, now.normal)
    # twice as much as elsewhere: noise that is taken for a load that turns back makes all of them stick
    of_noise = 2.0 * _MEAN_CHANGE * frame.noise * math.sqrt(2.0 * np.count_nonzero(frame.normal))
    if change(kept.load, now) <= tuning.least_load_change * now.normal + tuning.load_deviations * of_noise:
        return
    grow(kept, frame.normal, now.normal)
    kept.load[NORMAL], kept.load[X], kept.load[Y], kept.load[TURN] = now.normal, now.x, now.y, now.turn
    kept.normal[:] = frame.normal
    weigh_frictions(frame, now, kept, known)
    of_gel = spread_of_stiffness(frame.normal, frame.depth) ** 4
    kept.odds[:] *= of_gel / (of_gel + tuning.spring_spread**4)


@compiled
def sums(place: FloatArray, normal: FloatArray, sideways: FloatArray) -> SummedLoad:
    """The forces of all elements together."""
    total = normal.sum()
    x, y = sideways[:, 0].sum(), sideways[:, 1].sum()
    if total <= _LEAST_FORCE:
        return SummedLoad(total, x, y, 0.0, 0.0, 0.0, 0.0)
    centre_x, centre_y = (normal * place[:, 0]).sum() / total, (normal * place[:, 1]).sum() / total
    moment = distance = square = 0.0
    for i in range(len(normal)):
        rx, ry = place[i, 0] - centre_x, place[i, 1] - centre_y
        moment += rx * sideways[i, 1] - ry * sideways[i, 0]
        distance += normal[i] * math.hypot(rx, ry)
        square += normal[i] * (rx * rx + ry * ry)
    if square <= _LEAST_SPREAD:
        return SummedLoad(total, x, y, 0.0, centre_x, centre_y, 0.0)
    return SummedLoad(total, x, y, moment * total / distance, centre_x, centre_y, distance / square)


@compiled
def change(load: FloatArray, now: SummedLoad) -> float:
    """How far the load has gone since it was last looked at, N."""
    x, y, turn = now.x - load[X], now.y - load[Y], now.turn - load[TURN]
    return math.sqrt(x * x + y * y + turn * turn) + float(abs(now.normal - load[NORMAL]))


@compiled
def begin(kept: Layers, normal_force: float) -> None:
    """A contact that has just begun, without layers."""
    kept.load[:] = 0.0
    kept.load[SPACING] = 2.0 * normal_force / kept.traction.shape[1]
    kept.level[:] = 0.0
    kept.traction[:] = 0.0
    kept.normal[:] = 0.0


@compiled
def grow(kept: Layers, normal: FloatArray, normal_force: float) -> None:
    """Remember the normal forces of elements at each level reached; where levels run out, leave out every other."""
    load, level, last = kept.load, kept.level, kept.normal
    most = kept.traction.shape[1]
    top = min(int(load[REACHED]), int(normal_force / load[SPACING]))
    while normal_force >= load[SPACING] * (top + 1):
        if top + 1 >= most:
            halve(load, level, kept.traction)
            top //= 2
            continue
        top += 1
        part, grown = load[SPACING] * top - load[NORMAL], normal_force - load[NORMAL]
        share = min(max(part / grown, 0.0), 1.0) if grown > 0.0 else 1.0
        for i in range(len(normal)):
            level[top, i] = last[i] + share * (normal[i] - last[i])
    load[REACHED] = max(top, 1)


@compiled
def halve(load: FloatArray, level: FloatArray, traction: FloatArray) -> None:
    """Make two layers into one."""
    most = traction.shape[1]
    load[SPACING] *= 2.0
    for j in range(most // 2 + 1):
        level[j] = level[2 * j]
    for k in range(len(traction)):
        for j in range(most // 2):
            for axis in range(3):
                traction[k, j, axis] = 0.5 * (traction[k, 2 * j, axis] + traction[k, 2 * j + 1, axis])
        traction[k, most // 2 :] = 0.0


@compiled
def spread_of_stiffness(normal: FloatArray, depth: FloatArray) -> float:
    """How far normal forces are from being one stiffness times depth, as a share of their root mean square.

    Of elements of one gel they are far, for each is pressed in by its neighbours' forces, too, also one that bears
    nothing itself; pillars are springs by themselves, which slip as a whole. Where all that touch bear the same, as
    four around the middle of a contact, only those beside them show which it is.
    """
    forces = depths = both = 0.0
    for i in range(len(normal)):
        forces += normal[i] * normal[i]
        depths += depth[i] * depth[i]
        both += normal[i] * depth[i]
    if depths <= _LEAST_SPREAD:
        return 0.0
    return math.sqrt(max(1.0 - both / forces * both / depths, 0.0))


@compiled
def weigh_frictions(seen: PressedElements, now: SummedLoad, kept: Layers, grid: Considered) -> None:
    """Fill the log-odds [k] of slip: under each friction the share that sticks, weighed by how well it explains the
    elements' forces.
    """
    friction, normal = grid.friction, seen.normal
    tuning = layer_tuning(grid.settings)
    spacing = kept.load[SPACING]
    full = min(int(now.normal / spacing), kept.traction.shape[1] - 1)
    known = min(full, int(kept.load[REACHED]))
    weights, unexplained, slips = (
        np.empty(len(friction)),
        np.empty(len(friction)),
        np.empty((len(friction), len(normal))),
    )
    rise = rises(kept.level, normal, full, known)
    for k in range(len(friction)):
        core = load_layers(kept.traction[k], friction[k], tuning.layer_misfit, now, spacing, full)
        misfit = left = size = 0.0
        for i in range(len(normal)):
            if normal[i] <= 0.0:
                continue
            stuck = stick_share(kept.level[:, i], normal[i], core, now.normal, spacing, full, known)
            slips[k, i] = 1.0 / (1.0 + math.exp((stuck - tuning.layer_stick_share) / tuning.layer_stick_width))
            x, y = force_of_layers(kept.traction[k], rise[i], seen.place[i], now)
            variance = max(seen.noise**2 + (tuning.layer_misfit * friction[k] * normal[i]) ** 2, _LEAST_FORCE**2)
            square = (seen.sideways[i, 0] - x) ** 2 + (seen.sideways[i, 1] - y) ** 2
            misfit += 0.5 * square / variance + math.log(variance)
            left, size = left + square, size + variance
        weights[k] = grid.prior[k] - tuning.layer_evidence * misfit
        unexplained[k] = left / size
    weights = np.exp(weights - weights.max())
    weights /= weights.sum()
    fits = 1.0 / (1.0 + ((weights * unexplained).sum() / 2.0) ** 2)
    least = 1.0 / (1.0 + math.exp(tuning.largest_sum))
    for i in range(len(normal)):
        kept.odds[i] = 0.0
        if normal[i] > 0.0:
            slip = min(max((weights * slips[:, i]).sum(), least), 1.0 - least)
            kept.odds[i] = fits * math.log(slip / (1.0 - slip))


@compiled
def rises(level: FloatArray, normal: FloatArray, full: int, known: int) -> FloatArray:
    """By how much the normal force of each element rises in each layer, [k, full + 1] N."""
    rise = np.zeros((len(normal), full + 1))
    for i in range(len(normal)):
        for j in range(full + 1):
            upper = level[j + 1, i] if j < full and j < known else normal[i]
            rise[i, j] = upper - level[j, i]
    return rise


@compiled
def load_layers(
    traction: FloatArray, friction: float, slack: float, now: SummedLoad, spacing: float, full: int
) -> float:
    """Bring the traction [layers, 3] of one ``friction`` to the load now: slip reaches in as far as is needed to bear
    it. The normal force of what still sticks, N; what comes to the limit by a share of ``slack`` counts as slipping.
    """
    traction[full + 1 :] = 0.0
    x, y, turn = held(traction, spacing, full, now.normal)
    for j in range(full, -1, -1):
        width = spacing if j < full else now.normal - full * spacing
        x, y, turn = x - traction[j, 0] * width, y - traction[j, 1] * width, turn - traction[j, 2] * width
        rest_x, rest_y, rest_turn = now.x - x, now.y - y, now.turn - turn
        rest = math.sqrt(rest_x * rest_x + rest_y * rest_y + rest_turn * rest_turn)
        if rest <= friction * (now.normal - j * spacing):
            outer = now.normal - (j + 1) * spacing if j < full else 0.0
            inside = (rest - friction * outer) / width if width > 0.0 else 0.0
            scale = 1.0 / max(rest, _LEAST_FORCE)
            for above in range(j, full + 1):
                set_layer(traction[above], scale * (friction if above > j else inside), rest_x, rest_y, rest_turn)
            return sticking_force(traction, friction, slack, spacing, full, now.normal)
    size = friction / max(math.sqrt(now.x**2 + now.y**2 + now.turn**2), _LEAST_FORCE)
    for j in range(full + 1):
        set_layer(traction[j], size, now.x, now.y, now.turn)
    return 0.0


@compiled
def set_layer(layer: FloatArray, size: float, x: float, y: float, turn: float) -> None:
    """Give a layer traction [3] of this size times a direction."""
    layer[0], layer[1], layer[2] = size * x, size * y, size * turn


@compiled
def held(traction: FloatArray, spacing: float, full: int, normal_force: float) -> tuple[float, float, float]:
    """What all layers bear along x and y and in turn, N."""
    x = y = turn = 0.0
    for j in range(full + 1):
        width = spacing if j < full else normal_force - full * spacing
        x, y, turn = x + traction[j, 0] * width, y + traction[j, 1] * width, turn + traction[j, 2] * width
    return x, y, turn


@compiled
def sticking_force(
    traction: FloatArray, friction: float, slack: float, spacing: float, full: int, normal_force: float
) -> float:
    """The normal force, N, of the layers within those that are at the limit of friction the outermost's way."""
    narrow = full > 0 and normal_force - full * spacing <= 0.25 * spacing
    outermost = full - 1 if narrow else full
    x, y, turn = traction[outermost, 0], traction[outermost, 1], traction[outermost, 2]
    scale = 1.0 / (friction * max(math.sqrt(x * x + y * y + turn * turn), _LEAST_FORCE))
    core = normal_force
    for j in range(full, -1, -1):
        borne = scale * (traction[j, 0] * x + traction[j, 1] * y + traction[j, 2] * turn)
        if borne < 1.0 - slack:
            return core if j >= outermost or borne <= 0.0 else (j + 1 - borne) * spacing
        core = j * spacing
    return core


@compiled
def stick_share(
    level: FloatArray, normal: float, core: float, normal_force: float, spacing: float, full: int, known: int
) -> float:
    """Share of an element's ``normal`` force, N, that it bore when the contact bore what now still sticks."""
    below = min(int(core / spacing), full)
    inner = level[below]
    if below < full and below < known:
        outer, width = level[below + 1], spacing
    else:
        outer, width = normal, max(normal_force - below * spacing, _LEAST_FORCE)
    share = (inner + (outer - inner) * min((core - below * spacing) / width, 1.0)) / normal
    return float(min(max(share, 0.0), 1.0))


@compiled
def force_of_layers(traction: FloatArray, rise: FloatArray, place: FloatArray, now: SummedLoad) -> tuple[float, float]:
    """Tangential force, N, of an element at ``place`` [2] m whose normal force ``rises`` so by layers."""
    x = y = turn = 0.0
    for j in range(len(rise)):
        x, y, turn = x + rise[j] * traction[j, 0], y + rise[j] * traction[j, 1], turn + rise[j] * traction[j, 2]
    turn *= now.lever
    return x - turn * (place[1] - now.centre_y), y + turn * (place[0] - now.centre_x)
