"""Forces of logs that have none, where their sensor's gel is known."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from slipcore import Finding, GraspLog
    from slipcore.forces import Reconstruction

RECONSTRUCTED = "reconstructed forces"
"""The finding of a log whose forces follow from its sensor's gel."""

NOT_CHECKED = "forces not checked"
"""That of one whose own metadata say that its forces follow from displacement."""

BY_DISPLACEMENT = frozenset({RECONSTRUCTED, NOT_CHECKED})
"""Findings of logs whose forces no sensor measured."""

BY_ANOTHERS_GEL = "another's gel"
"""That of one whose sensor's gel was described by another key than sent it, which is no admin's."""

CONTRADICTED = "gripper's force contradicted"
"""That of one whose gel implies another normal force than the gripper reports."""


def needs_forces(log: "GraspLog") -> bool:
    """Whether a log has none, and displacements in metres from which they would follow."""
    return log.force is None and log.is_scaled


def bytes_needed(log: "GraspLog") -> int:
    """What a reconstruction of its forces takes of memory at least; raises ``InvalidInput`` for an absurd lattice."""
    from slipcore.forces.tracking import look  # few logs need it

    return look.bytes_needed(log.position, log.element_area)


def with_forces(log: "GraspLog", gel: Mapping[str, Any]) -> "tuple[GraspLog, Reconstruction]":
    """The log with forces that follow from its displacement by this gel (``slipcore.forces.Gel.from_json``)."""
    from slipcore.forces import Gel, reconstruct  # few logs need it

    found = reconstruct(log, Gel.from_json(gel))
    return found.apply(log), found


def reconstruction_findings(log: "GraspLog", reconstruction: "Reconstruction | None") -> "list[Finding]":
    """That forces are reconstructed, and how well they are known; nothing where they are the sensor's.

    A log's own metadata may say so of the forces in it: then what was not checked is told.
    """
    from slipcore import Finding

    if reconstruction is None:
        if not log.has_reconstructed_force:
            return []
        evidence = (
            "by the log's own metadata its forces follow from displacement: zero, frame and range were not checked"
        )
        return [Finding(NOT_CHECKED, evidence, "leave out `force` of the metadata where a sensor measured them")]
    shares = ", ".join(f"{axis} {share:.0%}" for axis, share in zip("xyz", reconstruction.information, strict=True))
    evidence = (
        f"forces follow from displacement by the sensor's gel{_by_the_gripper(reconstruction)}, in effect "
        f"averaged over {1e3 * reconstruction.kernel_width:.2g} mm; share of the resultant by the data: {shares}"
    )
    evidence += f"; a normal force of {reconstruction.unnoticed[2]:.2g} N or less would move no marker beyond noise"
    if reconstruction.saturated.any():
        count = reconstruction.saturated.any(axis=(0, 3)).sum()
        evidence += f"; displacements of {count} elements at the end of the sensor's range count as not seen"
    by_gel = Finding(RECONSTRUCTED, evidence, "friction is as sure as the description of the sensor's gel")
    return [by_gel, *contradicted(reconstruction.contradicted)]


def is_anothers(described_by: str | None, uploaded_by: str | None) -> bool:
    """Whether a log's gel was described by a key that is no admin's and did not send it."""
    return described_by is not None and described_by != uploaded_by


def described_by_another(described_by: str | None, uploaded_by: str | None) -> "list[Finding]":
    """That the gel by which a log's forces are reconstructed was described by a key that did not send it."""
    from slipcore import Finding

    if not is_anothers(described_by, uploaded_by):
        return []
    evidence = f"key {described_by} described the sensor's gel, by which forces are reconstructed"
    remedy = "compare it with the sensor's own, let an admin describe that, and send again; or use a name of your own"
    return [Finding(BY_ANOTHERS_GEL, evidence, remedy)]


def contradicted(share: float) -> "list[Finding]":
    """That the gripper's force is, where it is in such a share of the frames that touch."""
    from slipcore import Finding
    from slipcore.forces.defaults import RECONSTRUCTION

    if share <= RECONSTRUCTION.contradicted_share:
        return []
    evidence = f"in {share:.0%} of the frames that touch the gel's shape implies another force"
    return [Finding(CONTRADICTED, evidence, "make sure that it is this finger's, in N, and the gel's description")]


def early_touch() -> "Finding":
    """That something touched before a stream's forces could be known."""
    from slipcore import Finding

    evidence = "markers were moved before the noise of the sensor and its gel's response were known"
    return Finding("no rest", evidence, "open the stream two seconds before the touch")


def at_end_of_range(elements: int) -> "list[Finding]":
    """That some of a frame's displacements are at the end of the sensor's range, where so many elements' are."""
    from slipcore import Finding

    if not elements:
        return []
    evidence = f"displacements of {elements} elements are at the end of the sensor's range and count as not seen"
    return [Finding("saturation", evidence, "press less, or choose a wider range of the sensor")]


def _by_the_gripper(reconstruction: "Reconstruction") -> str:
    """That the resultant was given, where it was."""
    return " and from the normal force that the gripper reports" if reconstruction.given[:, 2].any() else ""
