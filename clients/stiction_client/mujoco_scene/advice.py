"""Which settings of a scene to change, so that its contacts hold what they are meant to."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

from stiction_client.exports.mujoco import HOLDING_OPTION
from stiction_client.mujoco_scene.holding import Held
from stiction_client.mujoco_scene.rule import Rule

TOLERANCE = 0.02
"""Of friction, relative: closer is as it is meant."""

CREEP = 1e-3
"""m/s that a held object may creep."""

LARGEST = 5.0
"""No dry pair of materials has more friction; larger values are put in to stop creep."""


@dataclass(frozen=True, slots=True)
class Written:
    """What a scene says of a pair of geoms: their ``names``, empty where they have none; the sliding friction of
    ``each``; the ``rule`` between them; and the contact's dimension, its five ``friction`` coefficients that follow
    from these, and at how many ``points`` it touches.
    """

    names: tuple[str, str]
    each: tuple[float, float]
    rule: Rule
    dimension: int
    friction: tuple[float, ...]
    points: float

    @property
    def sliding(self) -> float:
        """The smaller of the two sliding coefficients; 0 for a contact without friction."""
        return min(self.friction[:2]) if self.dimension > 1 else 0.0


def advice(written: Written, now: Held, then: Held | None, wanted: float | None) -> tuple[str, ...]:
    """All that should be changed; ``then``: what is held with ``HOLDING_OPTION``, None where the scene has that;
    ``wanted``: what friction is to be, None if nobody says.
    """
    return (*_of_solver(written, now, then), *_of_geoms(written), *_of_friction(written, wanted))


def speed(held: Held) -> str:
    """How fast it creeps, in words."""
    if not math.isfinite(held.creep):
        return "slips"
    return f"creeps {1e3 * held.creep:.2g} mm/s" if held.creep > 1e-6 else "creeps less than 0.001 mm/s"


def _of_solver(written: Written, now: Held, then: Held | None) -> Iterator[str]:
    if then is None or (now.friction >= (1.0 - TOLERANCE) * written.sliding and now.creep <= CREEP):
        return
    if then.friction > (1.0 + TOLERANCE) * now.friction or then.creep < 0.5 * now.creep:
        yield (
            f"put {HOLDING_OPTION} into the model: it then holds {then.friction:.3g} instead of {now.friction:.3g}; "
            f"at 95 % of its friction it {speed(then)}, now it {speed(now)}"
        )


def _of_geoms(written: Written) -> Iterator[str]:
    if written.dimension == 1:
        yield 'condim="1" has no friction at all: give the pair condim="3", or "4" for a soft finger'
    if written.dimension == 3 and written.points < 1.5:
        yield 'one point of contact with condim="3" turns freely about its normal: a soft finger has condim="4"'
    if written.sliding > LARGEST:
        yield f"no material has a friction of {written.sliding:.3g}; if it is to stop creep, mend the solver instead"
    if written.rule == "override":
        yield 'o_friction stands above everything: take <flag override="enable"/> out'


def _of_friction(written: Written, wanted: float | None) -> Iterator[str]:
    undone = written.rule in ("max", "priority") and written.each[0] != written.each[1]
    wrong = wanted is not None and abs(written.sliding / wanted - 1.0) > TOLERANCE
    if wrong:
        yield f"its friction is to be {wanted:.3g}, and is {written.sliding:.3g}"
    if undone or wrong:
        sliding = min(written.each) if wanted is None else wanted
        yield f"only a pair is safe from what either geom says: {_pair_element(written, sliding)}"


def _pair_element(written: Written, sliding: float) -> str:
    first, second = (name or "NAME IT" for name in written.names)
    friction = " ".join(f"{value:.6g}" for value in (sliding, sliding, *written.friction[2:]))
    return f'<pair geom1="{first}" geom2="{second}" condim="{max(written.dimension, 3)}" friction="{friction}"/>'
