"""What a live detector keeps: plain records, and the log that they make."""

import math
from collections.abc import Mapping, Sequence
from concurrent.futures import Future
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from service.stream.grip import Grip
from service.stream.messages import Control
from service.stream.reconstructing import Reconstructing
from slipcore import Finding, Frame, GraspLog, SlipState
from slipcore.frames import UNNAMED

if TYPE_CHECKING:
    import stiction_client
    from estimators import Moments
    from slipcore import SlipDetector

WINDOW, STRIDE = 45, 30
"""Frames that friction samples are looked for in, and frames from one look to the next: once a second."""

Numbers = bytes | Sequence[float]
"""Numbers in a row, row-major: bytes of little-endian float32 or float64, or flat."""


class PackedFrame(NamedTuple):
    """A frame as it comes from the server's process; ``command`` is the normal force commanded to the gripper, N, and
    ``gripper_force`` the one that it reports, with its standard ``gripper_force_deviation``.
    """

    number: int
    time: float
    displacement: Numbers
    force: Numbers | None = None
    object_pose: Numbers | None = None
    normal: Numbers | None = None
    command: float | None = None
    gripper_force: float | None = None
    gripper_force_deviation: float | None = None


class MemoryLimit(NamedTuple):
    """Of all sessions together ``most_bytes``, of which one ``owner`` has half of what the others leave."""

    owner: str
    most_bytes: int


class SessionOptions(NamedTuple):
    """What a session has beside its detector, each where it was asked for or is known.

    ``control``: of a grip controller that answers its frames, and begins with ``model`` if there is one, or else
    recognises one of ``materials``; ``gel``: of the sensor (``slipcore.forces.Gel.from_json``), by which forces follow
    where frames have none.
    """

    control: Control | None = None
    model: "stiction_client.FrictionModel | None" = None
    gel: Mapping[str, Any] | None = None
    materials: "Mapping[str, stiction_client.FrictionModel] | None" = None


@dataclass(slots=True)
class DetectorSession:
    """A running detector with what it saw: the last frames and answers, all frames if they are ``kept``, with what the
    gripper ``reported`` in them; and the controller of the grip, where one was asked for.

    Where ``chooses_detector`` is set, the first frame decides which one suits. ``forces`` are reconstructed where its
    sensor's gel is known and its frames have none. ``findings``: what its first
    frame shows to cost it friction. ``friction`` is what its client is told, ``expected`` what those are who watch it;
    ``begun``: time of its first frame, s.
    """

    detector: "SlipDetector"
    position: NDArray[np.float64]
    element_area: float
    moments: "Moments"
    limit: MemoryLimit
    kept: list[Frame] | None
    chooses_detector: bool = False
    reported: list[float | None] = field(default_factory=list)
    report_deviation: float | None = None
    most_reported: float = 0.0
    grip: Grip | None = None
    forces: Reconstructing | None = None
    findings: list[Finding] = field(default_factory=list)
    frames: list[Frame] = field(default_factory=list)
    answers: list[SlipState] = field(default_factory=list)
    until_look: int = WINDOW
    look: Future[None] | None = None
    looked_until: float = -math.inf
    last: tuple[int, dict[str, Any]] = (-1, {})
    friction: dict[str, Any] | None = None
    expected: dict[str, float] | None = None
    held_bytes: int = 0
    begun: float | None = None

    @property
    def method(self) -> str:
        """Its method of detection."""
        return self.detector.state.setup.method

    @property
    def all_bytes(self) -> int:
        """With what its forces take."""
        return self.held_bytes + (0 if self.forces is None else self.forces.held_bytes)


def log_of(session: DetectorSession, frames: Sequence[Frame], sensor: str, metadata: dict[str, str]) -> GraspLog:
    """Frames of a session as a log."""

    def stacked(name: str) -> NDArray[np.float64] | None:
        parts = [getattr(frame, name) for frame in frames]
        return None if any(part is None for part in parts) else np.stack(parts)

    return GraspLog(
        time=np.array([frame.time for frame in frames]),
        position=session.position,
        displacement=np.stack([frame.displacement for frame in frames]),
        element_area=session.element_area,
        force=stacked("force"),
        object_pose=stacked("object_pose"),
        normal=stacked("normal"),
        sensor=sensor or UNNAMED,
        metadata=metadata,
    )
