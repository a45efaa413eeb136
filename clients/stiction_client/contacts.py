"""Contacts that bear a load together: how large each is, how its pressure is spread, and what torque it bears."""

import math
from dataclasses import dataclass

import numpy as np

from stiction_client.arguments import number, of_kind, of_one_shape, whole, within
from stiction_client.elementwise import Number, hypot
from stiction_client.errors import InvalidArgument

AREAS = (1e-12, 1.0)
"""m² that a contact of a gripper may have."""

FORCES = (1e-9, 1e9, "N")
"""Under which it may have that area."""

LEVER_ARMS = (1e-6, 1e3, "m")
"""From the axis of an object to the fingers around it."""

PRESSURE_SQUARES = (0.999999, 1e12)
"""Mean of the squared pressure over the square of its mean: 1 of uniform pressure, but for rounding."""

UNIFORM_TORSION, HERTZ_TORSION = 2.0 / 3.0, 3.0 * math.pi / 16.0
"""Friction moment of a contact over μ F_N a (a: contact radius), under uniform pressure and under Hertz's
(Johnson, Contact Mechanics, 1985, section 3.9)."""

HERTZ_SQUARE = 9.0 / 8.0
"""Mean of the squared pressure of Hertz over the square of its mean: by how much its elements' forces, each weighted
with itself, exceed their mean."""


@dataclass(frozen=True, slots=True)
class Contact:
    """One contact: area A = ``area``·(F/``reference_force``)^⅔ m² under the normal force F, or ``area`` at any force.

    ``pressure_square``: mean of p² over the square of the mean of p, 1 for uniform pressure. ``torque_arm`` m: the
    friction moment over μF, at ``reference_force`` where the area grows (its radius with F^⅓).
    """

    area: Number
    reference_force: float | None = None
    pressure_square: Number = 1.0
    torque_arm: Number = 0.0

    def __post_init__(self) -> None:
        within("area", self.area, *AREAS, "m²")
        if self.reference_force is not None:
            number("reference_force", self.reference_force, *FORCES)
        within("pressure_square", self.pressure_square, *PRESSURE_SQUARES)
        within("torque_arm", self.torque_arm, 0.0, 10.0, "m")
        of_one_shape(area=self.area, pressure_square=self.pressure_square, torque_arm=self.torque_arm)

    @classmethod
    def flat(cls, area: Number) -> "Contact":
        """A disk of ``area`` m² under uniform pressure, at any force."""
        area = within("area", area, *AREAS, "m²")
        return cls(area, None, 1.0, UNIFORM_TORSION * (area / math.pi) ** 0.5)

    @classmethod
    def round(cls, area: Number, at_force: float) -> "Contact":
        """A round fingertip: its contact has ``area`` m² under ``at_force`` N, and grows with force as Hertz's does."""
        area, force = within("area", area, *AREAS, "m²"), number("at_force", at_force, *FORCES)
        return cls(area, force, HERTZ_SQUARE, HERTZ_TORSION * (area / math.pi) ** 0.5)

    @classmethod
    def measured(cls, pressure: Number, x: Number, y: Number, element_area: float) -> "Contact":
        """A contact as a sensor sees it: ``pressure`` Pa of elements of ``element_area`` m² at ``x``, ``y`` m, three
        arrays of one shape, such as [rows, columns].

        Its area is that of the elements under pressure and stays so at any force.
        """
        p = np.asarray(within("pressure", pressure, 0.0, 1e12, "Pa"))
        places = [np.asarray(within(name, place, -1.0, 1.0, "m")) for name, place in (("x", x), ("y", y))]
        if any(place.shape != p.shape for place in places):
            sizes = " and ".join(str(list(each.shape)) for each in (p, *places))
            raise InvalidArgument("pressure, x and y", f"{sizes} numbers", "three arrays of one shape")
        p, places = p.ravel(), [place.ravel() for place in places]
        element = number("element_area", element_area, *AREAS, "m²")
        within("total pressure", float(p.sum()), 1e-300, 1e300, "Pa, above 0")
        p = p / p.max()  # whose squares then cannot underflow
        force = float(p.sum())
        radius = np.hypot(*(place - float(p @ place) / force for place in places))
        pressed = int((p > 0.0).sum())
        return cls(pressed * element, None, float(p @ p) * pressed / force**2, float(p @ radius) / force)

    def element_force(self, force: Number, element_area: Number) -> Number:
        """Normal force of an element of ``element_area`` m², each weighted with itself, under ``force`` N; N."""
        return force / self.elements(force, element_area)

    def elements(self, force: Number, element_area: Number) -> Number:
        """(Σf)²/Σf²: over how many elements of ``element_area`` m² friction under ``force`` N averages."""
        grown = 1.0 if self.reference_force is None else (force / self.reference_force) ** (2.0 / 3.0)
        return self.area * grown / (element_area * self.pressure_square)

    def arm(self, force: Number) -> Number:
        """Friction moment over μF under ``force`` N, m."""
        return self.torque_arm * (
            1.0 if self.reference_force is None else (force / self.reference_force) ** (1.0 / 3.0)
        )

    def as_forces(self, load: Number, torque: Number) -> tuple[Number, Number]:
        """Load and torque as two tangential forces, N, that add as root of squares: one that does not change with the
        normal force, and one for a torque arm that grows with it, under 1 N. Without an arm no torque counts.
        """
        arm = self.arm(1.0)
        twist = torque / (arm + (arm == 0.0))
        return (load, twist) if self.power > 1 else (hypot(load, twist), 0.0)

    @property
    def power(self) -> int:
        """n, where F^(1/n) is what the elements' normal force grows with."""
        return 1 if self.reference_force is None else 3


@dataclass(frozen=True, slots=True)
class Contacts:
    """``count`` equal contacts, pressed with the same normal force; the load is shared evenly.

    Of equal contacts none needs less in total: what a contact holds under a force is concave in it. A torque about the
    axis of the load is borne as moments of the contacts about their common normal (``lever_arm`` None), or as
    tangential forces at ``lever_arm`` m from the axis.
    """

    contact: Contact
    count: int = 1
    lever_arm: Number | None = None

    def __post_init__(self) -> None:
        of_kind("contact", self.contact, Contact)
        whole("count", self.count, 1, 100, "contacts")
        if self.lever_arm is not None:
            within("lever_arm", self.lever_arm, *LEVER_ARMS)


def grasp(area: float, round_at: float | None = None, fingers: int = 1, object_radius: float | None = None) -> Contacts:
    """Equal fingers by what they are on a form: flat, or round with ``area`` m² under ``round_at`` N.

    A torque is about the fingers' common normal, or about the axis of an object of ``object_radius`` m.
    """
    contact = Contact.flat(area) if round_at is None else Contact.round(area, round_at)
    if object_radius is not None:
        return n_fingers(fingers, contact, object_radius)
    return Contacts(contact, whole("fingers", fingers, 1, 100))


def antipodal(contact: Contact) -> Contacts:
    """Two fingers that press against each other; a torque is one about the line between them."""
    return Contacts(contact, 2)


def n_fingers(count: int, contact: Contact, object_radius: Number) -> Contacts:
    """Fingers evenly around an object of ``object_radius`` m, such as a lid; a torque is about the object's axis."""
    return Contacts(
        contact, whole("count", count, 1, 100, "fingers"), within("object_radius", object_radius, *LEVER_ARMS)
    )
