"""Forces of a live stream whose frames have none, by the gel of its sensor."""

import logging
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field
from math import isnan
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from service.domain.sensors.reconstruct import at_end_of_range, contradicted
from service.processes.fair_executor import FairExecutor
from service.stream.observing import SampledForces
from slipcore import Frame, InvalidInput

if TYPE_CHECKING:
    from slipcore.forces import ForceStream

logger = logging.getLogger(__name__)

MOST_MARKERS = 512
"""Whose forces are reconstructed: to set up as many takes seconds of a core, and some 200 MB for a moment."""

MOST_NODES = 1000
"""Elements' areas side by side under the markers and around them: with more it takes minutes, and gigabytes."""

MOST_FAILURES = 3
"""Looks that may fail before no forces are looked for any more."""

_LOOKS = FairExecutor(threads=2)
"""Sets streams up and looks for their contacts, so that frames need not wait for them: with 500 markers that takes
seconds, for which another owner's must not wait."""


@dataclass(slots=True)
class Reconstructing:
    """Forces of one session, by its sensor's ``gel`` (``slipcore.forces.Gel.from_json``).

    The first frame decides: with forces in it none are reconstructed, else there is a ``stream`` of them, or it is
    ``refused`` with this reason. Its contacts are sought in turns with those of other ``owner``s. ``deviation`` N of
    forces in the last frame, by which a detector goes; ``alike``: forces of the last frame as friction samples are
    collected from them, with the options ``of_samples`` as of the last frame in which anything touched.
    """

    gel: Mapping[str, Any]
    owner: str
    stream: "ForceStream | None" = None
    refused: str | None = None
    deviation: float = 0.0
    failures: int = 0
    alike: NDArray[np.float64] | None = None
    of_samples: dict[str, float] = field(default_factory=dict)

    @property
    def sampled(self) -> SampledForces | None:
        """Forces of the last frame as a grip controller samples friction from them, if any are reconstructed."""
        if self.stream is None or self.alike is None:
            return None
        return SampledForces(self.alike, self.of_samples["force_to_noise"] * self.of_samples["force_noise"])

    @property
    def held_bytes(self) -> int:
        """What the stream takes."""
        return 0 if self.stream is None else self.stream.held_bytes

    def begin(
        self, frame: Frame, position: NDArray[np.float64], area: float, check_room: Callable[[int], None]
    ) -> None:
        """Decide by the first frame, of which nothing is computed yet; ``check_room`` raises ``InvalidInput``."""
        if frame.force is not None:
            self.stream = self.refused = None
            return
        if self.stream is not None:  # the frame before was refused
            return
        from slipcore.forces import ForceStream, Gel  # few streams need it, and the server's process never

        count = position.shape[0] * position.shape[1]
        try:
            if count > MOST_MARKERS:
                raise InvalidInput("grid", f"{count} markers", f"at most {MOST_MARKERS}")
            stream = ForceStream(position, area, Gel.from_json(self.gel), executor=_LOOKS.of(self.owner))
            if stream.nodes > MOST_NODES:
                allowed = f"an area of which at most {MOST_NODES} cover the markers and what is around them"
                raise InvalidInput("element_area", f"{area:.3g} m²", allowed)
            check_room(stream.held_bytes)
        except InvalidInput as error:
            self.refused = f"{error.name} is {error.value}; allowed: {error.allowed}"
        else:
            self.stream = stream

    def end(self) -> None:
        """Give up what has not begun."""
        if self.stream is not None:
            self.stream.close()

    def step(
        self, frame: Frame, gripper_force: float | None = None, deviation: float | None = None
    ) -> tuple[Frame, dict[str, Any] | None]:
        """The frame with forces, and what its client is answered of them; raises ``InvalidInput``.

        ``gripper_force`` N, and its standard ``deviation`` N: what the gripper reports.
        """
        if (frame.force is None) != (self.stream is not None or self.refused is not None):
            raise InvalidInput("force", "missing" if frame.force is None else "given", "in every frame or in none")
        if self.refused is not None:
            return frame, {"source": "none", "reason": self.refused}
        if self.stream is None:
            return frame, None
        try:
            found = self.stream.step(frame.time, frame.displacement, None, gripper_force, deviation)
        except InvalidInput:
            raise
        except Exception:  # of a look beside the frames
            return self._without_look(frame, gripper_force, deviation)
        forces = found.forces
        self.alike = forces.alike
        self.deviation = found.force_deviation
        if forces.contact.any() or not self.of_samples:
            self.of_samples = forces.of_samples
        findings = [*at_end_of_range(found.saturated), *contradicted(self.stream.contradicted)]
        report = {
            "source": "reconstructed",
            "resultant": forces.resultant.tolist(),
            "deviation": forces.resultant_deviation.tolist(),
            "moment": forces.moment,
            "moment_deviation": forces.moment_deviation,
            "age": found.age,
            "wait_for": found.wait_for,
            "given": found.given,
            "contradiction": None if isnan(found.contradiction) else found.contradiction,
            "findings": [asdict(finding) for finding in findings],
        }
        normal = np.broadcast_to([0.0, 0.0, 1.0], forces.force.shape)  # loads act on the undeformed plane
        return frame._replace(force=forces.force, normal=normal, contact=found.contact), report

    def _without_look(
        self, frame: Frame, gripper_force: float | None, deviation: float | None
    ) -> tuple[Frame, dict[str, Any] | None]:
        """A look that fails costs the stream that look, and the last of some its forces."""
        logger.exception("a look for the contact failed")
        self.failures += 1
        if self.failures == MOST_FAILURES:
            self.stream, self.refused = None, "looking for the contact failed"
        return self.step(frame, gripper_force, deviation)
