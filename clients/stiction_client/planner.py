"""How hard to grip: the smallest normal force that keeps the probability of slip under a bound."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from decimal import ROUND_CEILING
from decimal import Context as Rounding
from typing import Any, Literal, overload

import numpy as np
from numpy.typing import NDArray

from stiction_client.arguments import of_one_shape, shown, within
from stiction_client.contacts import AREAS, Contact, Contacts
from stiction_client.defaults import MOST_SLIP
from stiction_client.elementwise import FloatArray, Number, anywhere, hypot, least, of_these, select
from stiction_client.errors import Cause, InvalidArgument, NoFeasibleForce
from stiction_client.holding import LoadedContact
from stiction_client.linear_friction import KINDS, LinearFriction, check_model
from stiction_client.quantile import FrictionQuantile
from stiction_client.support import DISAGREEMENT, Kind, kinds, slowest_shown

SLIP_PROBABILITY = 1e-3
"""Default bound: one slip in a thousand grasps that bear the full load."""

SLIP_PROBABILITIES = (1e-12, 0.5)
"""What may be asked for. Below, no data reach, and the quantile of Student's t is no longer computed reliably; above,
the quantile would be more optimistic than the mean, and the capacity no longer have a single peak."""

LARGEST = 1e9
"""N and N·m of a load, N of a limit."""

SAFETY_FACTORS = (1.0, 100.0)

COUNTS = (1.0, 1e12)
"""Elements in one contact."""

Outcome = Literal["held", "held within bounds", Cause]
"""One root, so that any greater force holds as well; two roots, between which all forces hold; or why there is none."""


@dataclass(frozen=True, slots=True)
class RequiredForce:
    """The planner's answer, forces in N, of each contact.

    ``normal_force``: the smallest that holds; ``feasible_interval``: smallest and largest that hold (infinite where
    there is no upper bound); ``margin``: the largest less the smallest, by how much a gripper may press too hard;
    ``largest_load``: the most tangential load on one contact, in the ratio to the torque that was asked for, that any
    force holds so (infinite where unbounded); ``element_force``: mean normal force of one element at the answer;
    ``friction_coefficient``: the conservative quantile there; ``within_domain``: whether velocity and element force lie
    where the model was observed; ``warning``: which of them does not, or what else speaks against the answer, or None;
    ``of``: whether the quantile is that of one "element" or of the mean over the contact's ``elements``; ``support``
    and ``advice``: what the answer rests on, and what to do about it (``support.Support``); ``notes``: what else is to
    be known of the model.
    """

    normal_force: float
    feasible_interval: tuple[float, float]
    margin: float
    largest_load: float
    element_force: float
    friction_coefficient: float
    slip_probability: float
    within_domain: bool
    warning: str | None
    of: str = "element"
    elements: float = 1.0
    support: Kind = "supported"
    advice: str = ""
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class RequiredForces:
    """The planner's answers to many grasps, each array of their common shape; NaN where no force holds.

    ``outcome`` names each case; the other fields are those of ``RequiredForce``.
    """

    normal_force: FloatArray
    feasible_interval: tuple[FloatArray, FloatArray]
    element_force: FloatArray
    friction_coefficient: FloatArray
    within_domain: NDArray[np.bool_]
    outcome: NDArray[np.str_]
    of: str
    elements: FloatArray
    support: NDArray[np.str_]


@overload
def required_normal_force(
    model: LinearFriction,
    tangential_load: float,
    slip_probability: float = ...,
    *,
    contact_area: float | None = ...,
    contacts: Contact | Contacts | None = ...,
    torque: float = ...,
    tangential_velocity: float = ...,
    safety_factor: float = ...,
    normal_force_limit: float | None = ...,
    of: str | None = ...,
    elements: float | None = ...,
) -> RequiredForce: ...


@overload
def required_normal_force(
    model: LinearFriction,
    tangential_load: FloatArray,
    slip_probability: Number = ...,
    *,
    contact_area: Number | None = ...,
    contacts: Contact | Contacts | None = ...,
    torque: Number = ...,
    tangential_velocity: Number = ...,
    safety_factor: Number = ...,
    normal_force_limit: Number | None = ...,
    of: str | None = ...,
    elements: Number | None = ...,
) -> RequiredForces: ...


def required_normal_force(
    model: LinearFriction,
    tangential_load: Number,
    slip_probability: Number = SLIP_PROBABILITY,
    *,
    contact_area: Number | None = None,
    contacts: Contact | Contacts | None = None,
    torque: Number = 0.0,
    tangential_velocity: Number = 0.0,
    safety_factor: Number = 1.0,
    normal_force_limit: Number | None = None,
    of: str | None = None,
    elements: Number | None = None,
) -> RequiredForce | RequiredForces:
    """Smallest normal force F (N) of each contact at which a grasp slips with at most ``slip_probability``.

    ``tangential_load`` N and ``torque`` N·m are borne by all ``contacts`` together; ``contact_area`` m² stands for
    one flat contact of it. ``tangential_velocity`` m/s; ``safety_factor`` multiplies the loads; ``normal_force_limit``
    N of each contact, the most that object or gripper bear. F is the smallest that meets the elliptic limit surface
    (Goyal, Ruina & Papadopoulos 1991; Howe & Cutkosky 1996) of each contact:

        q(v, f)·F ≥ √(T² + (M/b)²)

    with its share T of the load and M of the torque, its torque arm b, and q the ``slip_probability``-quantile of the
    predictive distribution of μ at its elements' normal force f, each weighted with itself: what a contact holds is
    Σ μ(fᵢ)·fᵢ. The uncertainty of all coefficients is in q, and the scatter ``of`` the "contact", which has a grasp's
    whole scatter and the mean of its ``elements``' own (as many as its area has, where None), or of one "element",
    which is conservative. None: of the contact where the model has ``scales``, else of an element; without
    scales all scatter counts as common to the elements in any case.

    Any argument but the model may be an array; all broadcast, and the answer is then ``RequiredForces``. For one
    grasp, raises ``NoFeasibleForce`` where no force holds. Raises ``InvalidArgument`` for an argument that cannot be.
    """
    check_model(model)
    together = _contacts(contact_area, contacts)
    of_one_shape(
        tangential_load=tangential_load,
        slip_probability=slip_probability,
        contact_area=together.contact.area,
        object_radius=together.lever_arm,
        torque=torque,
        tangential_velocity=tangential_velocity,
        safety_factor=safety_factor,
        normal_force_limit=normal_force_limit,
        elements=elements,
    )
    velocity = within("tangential_velocity", tangential_velocity, 0.0, 1e3, "m/s, as a magnitude")
    probability = within("slip_probability", slip_probability, *SLIP_PROBABILITIES)
    load, moment = _shares(together, tangential_load, torque, within("safety_factor", safety_factor, *SAFETY_FACTORS))
    limit = _limit(normal_force_limit)
    unit = together.contact.element_force(1.0, model.element_area)

    kind, mean_unit = _kind(model, of), unit / together.contact.pressure_square

    def asked(probability: Number) -> _Question:
        quantile = FrictionQuantile.over(model, velocity, probability)

        def loaded_with(count: Number) -> LoadedContact:
            return LoadedContact(quantile(count), load, moment, unit, together.contact.power)

        count, above = _averaged(kind, elements, together.contact, model.element_area, loaded_with)
        loaded = loaded_with(count)
        return _Question(model, together.count, velocity, probability, limit, loaded, mean_unit, kind, count, above)

    question = asked(probability)
    given = (load, moment, question.loaded.unit, velocity, probability, limit, question.elements)
    if any(isinstance(each, np.ndarray) for each in given):
        return _many(question, given)
    return _one(question, asked, tangential_load, _beside(float(torque), float(safety_factor)))


def _limit(normal_force: Number | None) -> Number:
    """The most that object or gripper bear, N."""
    return math.inf if normal_force is None else within("normal_force_limit", normal_force, 1e-9, LARGEST, "N")


@dataclass(frozen=True, slots=True, eq=False)
class _Question:
    """What was asked, with the share of the load of each of ``count`` contacts; ``mean_unit``·x is the mean normal
    force of its elements, N, and no x below ``above`` holds.
    """

    model: LinearFriction
    count: int
    velocity: Number
    probability: Number
    limit: Number
    loaded: LoadedContact
    mean_unit: Number
    of: str
    elements: Number
    above: Number

    def element_force(self, x: Number) -> Number:
        """Mean normal force of the contact's elements, N."""
        return self.mean_unit * x

    def only(self, where: NDArray[np.bool_]) -> "_Question":
        """What of these entries says why no force holds."""
        limit, mean_unit = of_these(self.limit, where), of_these(self.mean_unit, where)
        return replace(self, limit=limit, loaded=self.loaded.only(where), mean_unit=mean_unit)


def _kind(model: LinearFriction, of: str | None) -> str:
    """Whose friction is meant."""
    if of is None:
        return "element" if model.scales is None else "contact"
    if not isinstance(of, str) or of not in KINDS:
        raise InvalidArgument("of", shown(of), " or ".join(KINDS))
    return of


def _averaged(
    kind: str,
    elements: Number | None,
    contact: Contact,
    element_area: float,
    loaded_with: Callable[[Number], LoadedContact],
) -> tuple[Number, Number]:
    """Over how many elements scatter averages out, and an x above none that holds.

    A round contact has the more of them the harder it is pressed: they are counted under the force that would hold if
    scatter averaged out wholly, which is less than any that does hold.
    """
    if elements is not None:
        elements = within("elements", elements, *COUNTS)
    if kind == "element":
        return 1.0, 0.0
    if elements is not None:
        return elements, 0.0
    force: Number = 1.0
    above: Number = 0.0
    if contact.power > 1:
        most_averaged = loaded_with(math.inf)
        with np.errstate(all="ignore"):  # entries that are settled take part in the steps of the others
            above, _ = most_averaged.lowest(math.inf)
            force = most_averaged.force(above)
    count = contact.elements(force, element_area)
    return least(select(count > COUNTS[0], count, COUNTS[0]), COUNTS[1]), above


def _contacts(contact_area: Number | None, contacts: Contact | Contacts | None) -> Contacts:
    if (contact_area is None) == (contacts is None):
        raise InvalidArgument("contact_area and contacts", "both or neither given", "one of them")
    if contacts is None:
        return Contacts(Contact.flat(within("contact_area", contact_area, *AREAS, "m²")))
    if isinstance(contacts, Contact):
        return Contacts(contacts)
    if not isinstance(contacts, Contacts):
        raise InvalidArgument("contacts", shown(contacts), "a Contact, or what antipodal and n_fingers make of one")
    return contacts


def _shares(
    contacts: Contacts, tangential_load: Number, torque: Number, safety_factor: Number
) -> tuple[Number, Number]:
    """Each contact's share of the load, N, and of the torque as force at the torque arm of x = 1, N."""
    load = within("tangential_load", tangential_load, 0.0, LARGEST, "N, as a magnitude") * (
        safety_factor / contacts.count
    )
    turns = within("torque", torque, 0.0, LARGEST, "N·m, as a magnitude") * (safety_factor / contacts.count)
    if contacts.lever_arm is not None:
        return hypot(load, turns / contacts.lever_arm), 0.0
    contact = contacts.contact
    if anywhere(contact.torque_arm == 0.0) and anywhere(turns > 0.0):
        raise InvalidArgument("torque", float(np.max(torque)), "0 where the contact has no torque_arm")
    return contact.as_forces(load, turns)


def _beside(torque: float, safety_factor: float) -> str:
    """What is to be held beside the load, and by how much more, as a refusal names it."""
    turned = f", beside a torque of {torque:g} N·m" if torque > 0.0 else ""
    return turned + (f", with a safety factor of {safety_factor:g}" if safety_factor > 1.0 else "")


def _one(
    question: _Question, asked: Callable[[Number], _Question], tangential_load: Number, beside: str
) -> RequiredForce:
    """The answer to one question; ``asked``: the same at another slip probability."""
    loaded, most = question.loaded, float(question.loaded.root(question.limit))
    low, high, holds = loaded.interval(most, question.above)
    best = loaded.best(most)
    per_load = float(tangential_load) if loaded.load or loaded.moment else float(question.count)
    largest = math.inf if math.isinf(best) else loaded.held(best, per_load) if best > 0.0 else 0.0
    if not holds:
        raise NoFeasibleForce(
            float(tangential_load),
            largest,
            float(loaded.force(best)),
            _asked(question, beside),
            str(_causes(question)),
            question.model.domain.normal_force[1],
            _least_slip_probability(asked, float(question.probability)),
        )
    element = float(question.element_force(low))
    outside = question.model.extrapolation(float(question.velocity), element)
    support = question.model.support_at(float(question.velocity), element)
    bounds = float(loaded.force(low)), float(loaded.force(high))
    return RequiredForce(
        normal_force=bounds[0],
        feasible_interval=bounds,
        margin=bounds[1] - bounds[0],
        largest_load=largest,
        element_force=element,
        friction_coefficient=float(loaded.quantile(loaded.unit * low)[0]),
        slip_probability=float(question.probability),
        within_domain=outside is None,
        warning=support.warning(outside, str(question.model.diagnostics.get(DISAGREEMENT) or "")),
        of=question.of,
        elements=float(question.elements),
        support=support.kind,
        advice=support.advice,
        notes=question.model.notes,
    )


def _least_slip_probability(asked: Callable[[Number], _Question], refused: float) -> float | None:
    """The least above ``refused`` with which a force holds, to three digits rounded up; None: none by ``MOST_SLIP``."""

    def holds(probability: float) -> bool:
        question = asked(probability)
        return bool(question.loaded.lowest(question.loaded.root(question.limit))[1])

    below, above = refused, MOST_SLIP
    if below >= above or not holds(above):
        return None
    while above > 1.001 * below:
        middle = math.sqrt(below * above)
        below, above = (below, middle) if holds(middle) else (middle, above)
    return float(Rounding(prec=3, rounding=ROUND_CEILING).create_decimal_from_float(above))


def _many(question: _Question, given: tuple[Number, ...]) -> RequiredForces:
    loaded, model = question.loaded, question.model
    with np.errstate(all="ignore"):  # entries that are settled take part in the steps of the others
        ends = loaded.interval(loaded.root(question.limit), question.above)
        low, high, holds = np.broadcast_arrays(*ends, *given)[:3]
        outcome = np.where(np.isinf(high), "held", "held within bounds").astype("<U18")
        if not holds.all():
            outcome[~holds] = _causes(question.only(~holds))
        low, high = np.where(holds, low, np.nan), np.where(holds, high, np.nan)
        element = question.element_force(low)
        (least_force, most_force), fastest = model.domain.normal_force, model.domain.tangential_velocity[1]
        inside = (least_force <= element) & (element <= most_force)
        inside &= (slowest_shown(model) <= question.velocity) & (question.velocity <= fastest)
        return RequiredForces(
            normal_force=np.asarray(loaded.force(low)),
            feasible_interval=(np.asarray(loaded.force(low)), np.asarray(loaded.force(high))),
            element_force=np.asarray(element),
            friction_coefficient=np.asarray(loaded.quantile(loaded.unit * low)[0]),
            within_domain=np.asarray(inside),
            outcome=outcome,
            of=question.of,
            elements=np.broadcast_to(question.elements, low.shape),
            support=np.where(holds, kinds(model, question.velocity, element, model.stale), ""),
        )


def _causes(question: _Question) -> Any:
    """Why no force holds, in the order in which one would mend it (``Cause``); of no meaning where one does."""
    loaded = question.loaded
    beyond, could = loaded.lowest(math.inf)
    expected, possible = loaded.expected().lowest(math.inf)
    most = loaded.root(question.limit)
    observed = question.model.domain.normal_force[1]
    straight = replace(loaded, quantile=replace(loaded.quantile, below=0.0, above=0.0)).lowest(math.inf)[1]
    unobserved = (question.element_force(expected) > observed) | (straight & ~np.asarray(could))
    limited = (could & (beyond > most)) | (possible & (expected > most))
    return np.select([~np.asarray(possible), limited, unobserved], ["physics", "limit", "range"], "ignorance")


def _asked(question: _Question, beside: str) -> str:
    limited = "" if math.isinf(question.limit) else f", normal force up to {question.limit:g} N"
    return f"slip probability {question.probability:g}{beside}{limited}"
