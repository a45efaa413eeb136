"""Local slip: what a detector finds in one frame and in a whole log (stage 4: slip_state)."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from slipcore.element_forces import stick_ratio
from slipcore.finding import Finding
from slipcore.frames import BoolArray, FloatArray
from slipcore.patch_record import Patch
from slipcore.references import DETECTION, cited

if TYPE_CHECKING:
    from slipcore.labelled import DataFrame, Dataset, Variables


def element_states(contact: BoolArray, slip: BoolArray) -> NDArray[np.uint8]:
    """Of each element, in arrays of one shape: 0 no contact, 1 sticks, 2 slips."""
    return contact.astype(np.uint8) + (contact & slip)


@dataclass(frozen=True, slots=True, eq=False)
class SlipState:
    """What a detector finds in one frame.

    ``contact``, ``slip`` [n, m] bool; ``probability`` of slip [n, m]; ``stick_ratio``: stick area over contact area
    (paper, eq. 37 corrected), NaN without contact; ``velocity`` [n, m, 2] m/s, tangential velocity of the surface
    relative to the object, NaN where it is unobservable; ``macro_slip``: the contact slips as a whole, no zone of it
    sticks (``gross_slip.py``); ``observed`` [n, m], or None for all: of an element that was not, nothing is known, as
    if it did not touch.
    """

    time: float
    contact: BoolArray
    slip: BoolArray
    probability: FloatArray
    stick_ratio: float
    velocity: FloatArray
    macro_slip: bool
    observed: BoolArray | None = None

    def masked(self, observed: BoolArray, throughout: BoolArray) -> "SlipState":
        """The state without the elements [n, m] that were not ``observed``, nor velocity where not ``throughout``."""
        from slipcore.gross_slip import is_gross_slip  # compiled: who only reports slip goes without

        contact, slip = self.contact & observed, self.slip & observed
        return SlipState(
            self.time,
            contact,
            slip,
            np.where(observed, self.probability, 0.0),
            stick_ratio(contact, slip),
            np.where(throughout[..., None], self.velocity, np.nan),
            macro_slip=is_gross_slip(contact, slip),
            observed=observed,
        )


@dataclass(frozen=True, slots=True, eq=False)
class EventList:
    """Events of one kind: ``element`` [k] (row-major index on the lattice) and ``time`` [k] s, in order of time."""

    element: NDArray[np.int64]
    time: FloatArray

    def __len__(self) -> int:
        return len(self.element)


@dataclass(frozen=True, slots=True, eq=False)
class SlipEvents:
    """Changes of state: slip ``onset`` and ``end``, contact ``touch`` and ``release``."""

    onset: EventList
    end: EventList
    touch: EventList
    release: EventList


@dataclass(frozen=True, slots=True, eq=False)
class SlipHistory:
    """What a detector finds in a whole log: the fields of ``SlipState`` with a leading axis [t].

    ``noise``: estimated standard deviation of one marker coordinate, m (NaN where it could not be estimated);
    ``patches``: the contact as a whole (docs/patches.md), of a whole log alone; ``macro_slip`` is also where all of
    them slide or pivot over the markers; ``findings``: what the detector found inconsistent in the log.
    """

    time: FloatArray
    contact: BoolArray
    slip: BoolArray
    probability: FloatArray
    stick_ratio: FloatArray
    velocity: FloatArray
    macro_slip: BoolArray
    events: SlipEvents
    noise: float
    method: str
    observed: BoolArray | None = None
    patches: tuple[Patch, ...] = ()
    findings: tuple[Finding, ...] = ()

    def filled(self) -> "SlipHistory":
        """The history with what its neighbours say of each element that was not observed.

        Such an element touches where most of its observed neighbours do, and slips as probably as those that touch do
        in the mean; where none was observed nothing is known. Of edges and corners a corner counts half. ``observed``
        still says which elements these are; they have no velocity and no events.
        """
        if self.observed is None:
            return self
        from slipcore.gross_slip import find_gross_slip  # compiled, as above

        seen = _of_neighbours(self.observed.astype(float))
        touching = _of_neighbours((self.contact & self.observed).astype(float))
        slipping = _of_neighbours(np.where(self.contact & self.observed, self.probability, 0.0))
        touches = ~self.observed & (2.0 * touching > seen)
        mean = np.divide(slipping, touching, out=np.zeros_like(slipping), where=touches)
        contact, slip = self.contact | touches, self.slip | (touches & (mean > 0.5))
        some = contact.any(axis=(1, 2))
        ratio = np.full(len(self.time), np.nan)
        ratio[some] = 1.0 - slip[some].sum(axis=(1, 2)) / contact[some].sum(axis=(1, 2))
        return replace(
            self,
            contact=contact,
            slip=slip,
            probability=np.where(touches, mean, self.probability),
            stick_ratio=ratio,
            macro_slip=self.macro_slip & find_gross_slip(contact, slip),
        )

    @property
    def references(self) -> tuple[str, ...]:
        """The papers behind the method; none of one that this package does not know."""
        return cited(DETECTION.get(self.method, ()))

    def to_dataframe(self) -> "DataFrame":
        """One row a frame, by time: stick ratio, whether all of it slips, elements in contact and in slip.

        Raises ``ModuleNotFoundError`` where pandas is not installed.
        """
        from slipcore.labelled import table

        over_elements = (1, 2)
        columns = {
            "time": self.time,
            "stick_ratio": self.stick_ratio,
            "macro_slip": self.macro_slip,
            "elements_in_contact": self.contact.sum(axis=over_elements),
            "elements_in_slip": self.slip.sum(axis=over_elements),
        }
        return table(columns, method=self.method, noise=self.noise).set_index("time")

    def to_xarray(self) -> "Dataset":
        """All of it over time and elements, with units; raises ``ModuleNotFoundError`` where xarray is missing."""
        from slipcore.labelled import dataset

        cells = ("time", "row", "column")
        variables: Variables = {
            "contact": (cells, self.contact, "1"),
            "slip": (cells, self.slip, "1"),
            "probability": (cells, self.probability, "1"),
            "velocity": ((*cells, "plane_axis"), self.velocity, "m/s"),
            "observed": (cells, self.observed, "1"),
            "stick_ratio": (("time",), self.stick_ratio, "1"),
            "macro_slip": (("time",), self.macro_slip, "1"),
        }
        return dataset(variables, {"time": (("time",), self.time, "s")}, method=self.method, noise_m=self.noise)

    def _repr_html_(self) -> str:
        from slipcore.notebook import curve, summary

        touched = ~np.isnan(self.stick_ratio)
        least = f"{self.stick_ratio[touched].min():.3g}" if touched.any() else "never in contact"
        rows = {
            "detector": self.method,
            "in contact": f"{np.count_nonzero(touched)} of {len(self.time)} frames",
            "least stick ratio": least,
            "gross slip": f"{np.count_nonzero(self.macro_slip)} frames",
            "onsets of slip": len(self.events.onset),
        }
        return summary("Slip history", rows.items(), curve(self.stick_ratio, "stick ratio over time"))


def _of_neighbours(field: FloatArray) -> FloatArray:
    """Sum of each element's eight neighbours of a field [t, n, m], those across a corner by half."""
    wide = np.pad(field, ((0, 0), (1, 1), (1, 1)))
    rows = wide[:, :-2] + wide[:, 2:]
    beside = rows[..., 1:-1] + wide[:, 1:-1, :-2] + wide[:, 1:-1, 2:]
    total: FloatArray = beside + 0.5 * (rows[..., :-2] + rows[..., 2:])
    return total


def observed_over_time(slip_states: Sequence[SlipState]) -> BoolArray | None:
    """Which elements were observed, [t, n, m]; None where all were, always."""
    if all(state.observed is None for state in slip_states):
        return None
    return np.array(
        [np.ones_like(state.contact) if state.observed is None else state.observed for state in slip_states]
    )


def slip_events(time: FloatArray, contact: BoolArray, slip: BoolArray, observed: BoolArray | None = None) -> SlipEvents:
    """The changes of state in ``contact`` and ``slip`` [t, n, m] at times [t] s.

    A release ends slip without an ``end``: what let go did not stick again. The first frame changes nothing, and
    there is no answer for an element that was not ``observed`` [t, n, m] (None: all were) in both frames.
    """
    seen = True if observed is None else observed[:-1] & observed[1:]
    was, now = contact[:-1], contact[1:]
    slipped, slips = slip[:-1], slip[1:]
    return SlipEvents(
        onset=_event_list(time, slips & ~slipped & seen),
        end=_event_list(time, slipped & ~slips & now),
        touch=_event_list(time, now & ~was & seen),
        release=_event_list(time, was & ~now & seen),
    )


def _event_list(time: FloatArray, changed: BoolArray) -> EventList:
    frame, row, column = np.nonzero(changed)
    return EventList(row * changed.shape[2] + column, time[frame + 1])
