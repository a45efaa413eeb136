"""What the checks look at, and what they find."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from slipcore.defaults import CheckOptions
from slipcore.element_forces import ElementForces
from slipcore.finding import Finding
from slipcore.frames import BoolArray, FloatArray, GraspLog
from slipcore.patch_record import ContactFriction
from slipcore.samples import FrictionSamples
from slipcore.slip_state import SlipHistory


@dataclass(frozen=True, slots=True, eq=False)
class Subject:
    """What the checks look at; ``forces``, with pressing parts [t, n, m] N and the ``normal`` [t, n, m, 3] at which
    they are split, and ``samples``, where there are any.

    ``contact``: friction of the contact as a whole, None without forces or contact.
    ``total``: normal force of all elements, [t] N; ``held``: frames with at least half of the largest, [t].
    """

    log: GraspLog
    history: SlipHistory
    forces: ElementForces | None
    normal: FloatArray | None
    pressing: FloatArray
    samples: FrictionSamples | None
    contact: ContactFriction | None
    limits: CheckOptions
    total: FloatArray = field(init=False)
    held: BoolArray = field(init=False)

    def __post_init__(self) -> None:
        total = self.pressing.sum(axis=(1, 2))
        object.__setattr__(self, "total", total)
        object.__setattr__(self, "held", total > 0.5 * total.max(initial=0.0))


Check = Callable[[Subject], Iterator[Finding]]
