"""What speaks against a log, or against what was found in it."""

from dataclasses import dataclass
from typing import Literal

Severity = Literal["warning", "note"]
"""A warning makes friction doubtful; a note says what was not seen, or what was done about it."""

SEVERITIES: dict[str, Severity] = {
    "reconstructed forces": "note",
    "gripper's force contradicted": "note",
    "forces not checked": "note",
    "same grasp": "note",
    "another's calibration": "note",
    "another's gel": "note",
    "slow frames": "note",
    "fast frames": "note",
    "no displacement": "note",
    "no contact": "note",
    "places for displacement": "warning",
    "element area": "warning",
    "repeated frames": "note",
    "interpolated frames": "note",
    "force too large": "warning",
    "displacement too small": "note",
    "force pulls": "warning",
    "forces not believed": "note",
    "late forces": "warning",
    "early forces": "warning",
    "crosstalk": "warning",
    "rounded": "note",
    "lasting noise": "note",
    "smoothed": "note",
    "saturation": "warning",
    "no rest": "note",
    "zero offset": "warning",
    "zero drift": "warning",
    "leaning normals": "warning",
    "gripper's force differs": "warning",
    "leaning forces": "warning",
    "turned axes": "warning",
    "sideways force without load": "warning",
    "contact travels": "warning",
    "no slip": "note",
    "odd friction": "warning",
    "friction follows force": "warning",
    "friction differs by place": "warning",
    "scatter beyond noise": "warning",
    "contact contradicts elements": "note",
}
"""Of each finding's name. After a warning the ratio of an element's forces, the force at which it was seen, or the area
by which a grip follows from it is not the material's: models of such logs are implausible.
"""


@dataclass(frozen=True, slots=True)
class Finding:
    """Something to know about a log before its friction is used: its ``name`` in docs/checks.md, what was seen, and
    what to do about it.
    """

    name: str
    evidence: str
    remedy: str

    @property
    def code(self) -> str:
        """The ``name``, as the contract of names spells it."""
        return self.name

    @property
    def severity(self) -> Severity:
        """By ``SEVERITIES``: "warning" where friction is doubtful, else "note"."""
        return severity_of(self.name)


def severity_of(name: str) -> Severity:
    """That of the finding of this ``name``; a name that is not known, as of a newer version, is a note."""
    return SEVERITIES.get(name, "note")
