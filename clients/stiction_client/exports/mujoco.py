"""Friction for MuJoCo (mujoco.readthedocs.io, XML reference: contact/pair, geom, option; versions 3.11 and 4)."""

from dataclasses import dataclass
from typing import Unpack
from xml.sax.saxutils import quoteattr

from stiction_client.arguments import number, of_kind, shown, whole
from stiction_client.contacts import HERTZ_TORSION, Contact
from stiction_client.errors import InvalidArgument
from stiction_client.exports.coulomb import QUANTILE, Terms, conservative_friction
from stiction_client.linear_friction import LinearFriction, check_model
from stiction_client.quantile import FrictionQuantile

IMPRATIO, NOSLIP_ITERATIONS = 10, 3
HOLDING_OPTION = f'<option cone="elliptic" impratio="{IMPRATIO}" noslip_iterations="{NOSLIP_ITERATIONS}"/>'
"""Solver settings with which a contact holds what its friction says. With the defaults, a pyramidal cone and impratio
1, a box held at 95 % of its cone creeps until it falls."""

LEAST_FRICTION = 1e-5
"""What MuJoCo raises every smaller coefficient to."""


@dataclass(frozen=True, slots=True)
class MujocoPair:
    """A ``<pair>``, the only place where no other geom's value or priority undoes ours.

    ``sliding`` [-] and ``torsional`` m friction; ``adhesion`` N of each contact point, which adds to the normal force
    in the friction budget: μ·(f_N + adhesion).
    """

    geom1: str
    geom2: str
    sliding: float
    torsional: float
    adhesion: float

    def to_xml(self) -> str:
        """The element for ``<contact>``; put ``HOLDING_OPTION`` into the model, too."""
        friction = (self.sliding, self.sliding, max(self.torsional, LEAST_FRICTION), LEAST_FRICTION, LEAST_FRICTION)
        condim = 4 if self.torsional > 0.0 else 3
        numbers = " ".join(f"{value:.9g}" for value in friction)
        pulls = f' adhesion="{self.adhesion:.9g}"' if self.adhesion > 0.0 else ""
        geoms = f"geom1={quoteattr(self.geom1)} geom2={quoteattr(self.geom2)}"
        return f'<pair {geoms} condim="{condim}" friction="{numbers}"{pulls}/>'


def mujoco_pair(
    model: LinearFriction,
    geoms: tuple[str, str],
    grip_force: float,
    contact: Contact,
    quantile: float = QUANTILE,
    *,
    points: int = 1,
    load_faithful: bool = False,
    allow_unidentified: bool = False,
) -> MujocoPair:
    """Friction between two geoms that ``grip_force`` N presses together over ``contact``, at rest.

    With ``load_faithful``, for friction that falls with normal force, the pair has the contact's capacity C(F) = F·q
    and its slope at F = ``grip_force``: sliding friction C' and adhesion C/C' − F, shared by the ``points`` at which
    MuJoCo lets the geoms touch (four for a box's face). Without it, μ is that at ``grip_force`` whatever the force.
    Raises ``InvalidArgument`` where the quantile isn't positive, and where no adhesion stands for its slope: friction
    that grows with force, or falls so fast that pressing harder holds less.
    """
    first, second = _names(geoms)
    check_model(model)
    of_kind("contact", contact, Contact)
    force = number("grip_force", grip_force, 1e-9, 1e9, "N")
    count = whole("points", points, 1, 1000, "points")
    element = float(contact.element_force(force, model.element_area))
    elements = max(float(contact.elements(force, model.element_area)), 1.0)
    friction = conservative_friction(
        model, element, quantile, contact_area=elements * model.element_area, allow_unidentified=allow_unidentified
    )
    arm = float(contact.arm(force))
    if not load_faithful:
        return MujocoPair(first, second, friction, arm * friction, 0.0)
    _, slope = FrictionQuantile.of(model, 0.0, quantile, elements)(element)
    sliding = friction + element * float(slope) / contact.power
    if sliding > friction or sliding <= 0.0:
        grows = "grows" if sliding > friction else "falls so fast that pressing harder holds less"
        what = f"friction that {grows} at {force:.4g} N"
        raise InvalidArgument(
            "load_faithful", f"True with {what}", "friction that falls gently, or load_faithful=False"
        )
    return MujocoPair(first, second, sliding, arm * sliding, force * (friction / sliding - 1.0) / count)


def _names(geoms: tuple[str, str]) -> tuple[str, str]:
    """The names of two geoms; raises ``InvalidArgument`` for anything else."""
    names = tuple(geoms) if isinstance(geoms, tuple | list) else ()
    if len(names) != 2 or not all(isinstance(name, str) and name for name in names) or names[0] == names[1]:
        raise InvalidArgument("geoms", shown(geoms), 'the names of two geoms, such as ("fingertip", "box")')
    return names


def mujoco_friction(
    model: LinearFriction,
    normal_force: float,
    quantile: float = QUANTILE,
    *,
    contact_radius: float = 0.0,
    **terms: Unpack[Terms],
) -> tuple[float, float, float]:
    """MuJoCo's friction triple: sliding [-], torsional [m], rolling [m].

    Torsional friction is that of a Hertzian contact of ``contact_radius`` m (0: a point, none); rolling friction
    isn't in the model and is 0. Sliding friction is taken at rest.
    """
    radius = number("contact_radius", contact_radius, 0.0, 10.0, "m")
    sliding = conservative_friction(model, normal_force, quantile, **terms)
    return sliding, HERTZ_TORSION * radius * sliding, 0.0


def mujoco_geom(
    model: LinearFriction,
    normal_force: float,
    quantile: float = QUANTILE,
    *,
    contact_radius: float = 0.0,
    **terms: Unpack[Terms],
) -> str:
    """Attributes for a MuJoCo ``<geom>`` of the fingertip, as ``mujoco_friction`` has them.

    Of two geoms MuJoCo takes the larger friction unless one has priority: without it the object's default of 1
    would undo the conservative value.
    """
    triple = mujoco_friction(model, normal_force, quantile, contact_radius=contact_radius, **terms)
    condim = 4 if contact_radius > 0.0 else 3
    return f'friction="{" ".join(f"{value:.9g}" for value in triple)}" condim="{condim}" priority="1"'
