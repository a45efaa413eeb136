"""Routes of whoever keeps the materials in order: names, merges, withdrawn logs."""

from typing import Annotated

from fastapi import APIRouter, Path, Response

from db.records import Job, Material, StoredGraspLog
from service.domain.materials import curate
from service.http.access import UPLOAD, CurrentPrincipal
from service.http.bodies import JsonRoute
from service.http.conditional import IfMatch, changed, require_match
from service.http.context import ServerContext
from service.http.dependencies import CurrentContext
from service.http.descriptions import problems
from service.http.problems import (
    INVALID_REQUEST,
    MATERIAL_EXISTS,
    NOT_OWNER,
    PRECONDITION_FAILED,
    QUOTA_EXCEEDED,
    STORAGE_UNAVAILABLE,
    UNKNOWN_ALIAS,
    UNKNOWN_GRASP_LOG,
    UNKNOWN_MATERIAL,
    UNSUPPORTED_FORMAT,
    UPLOAD_TOO_LARGE,
)
from service.http.schemas.common import NAME_PATTERN, NAME_RULE, Reference
from service.http.schemas.grasp_logs import GraspLogOut, NewWithdrawal, WithdrawnOut
from service.http.schemas.jobs import JobOut
from service.http.schemas.materials import EpochOut, MaterialChange, MaterialOut, MergedOut, NewEpoch, NewMerge

router = APIRouter(prefix="/v1", route_class=JsonRoute)

Alias = Annotated[str, Path(pattern=NAME_PATTERN, description=NAME_RULE)]
KnownAlias = Annotated[Reference, Path(max_length=100, description="As it is; earlier versions took spaces at its end")]
_BODY = (UPLOAD_TOO_LARGE, UNSUPPORTED_FORMAT, INVALID_REQUEST, STORAGE_UNAVAILABLE)


@router.patch(
    "/materials/{name}",
    tags=["materials"],
    dependencies=[UPLOAD],
    summary="Rename or describe a material",
    response_model=MaterialOut,
    responses=problems(NOT_OWNER, UNKNOWN_MATERIAL, MATERIAL_EXISTS, PRECONDITION_FAILED, QUOTA_EXCEEDED, *_BODY),
)
def change_material(
    context: CurrentContext,
    name: str,
    change: MaterialChange,
    principal: CurrentPrincipal,
    if_match: IfMatch = None,
) -> Response:
    """The old name becomes an alias, so that whoever knows it still finds the material.

    With `If-Match`, the `ETag` of the material as it was read, only where it is still so; the answer has the
    `ETag` of the material as it is now.
    """

    def check(before: Material) -> None:
        require_match(if_match, lambda: MaterialOut.of(before).model_dump_json())

    found = curate.change(context, name, change.name, change.description, principal, check)
    return changed(MaterialOut.of(found).model_dump_json())


@router.put(
    "/materials/{name}/aliases/{alias}",
    tags=["materials"],
    dependencies=[UPLOAD],
    summary="Give a material one more name",
    responses=problems(
        NOT_OWNER, UNKNOWN_MATERIAL, MATERIAL_EXISTS, QUOTA_EXCEEDED, INVALID_REQUEST, STORAGE_UNAVAILABLE
    ),
)
def add_alias(context: CurrentContext, name: str, alias: Alias, principal: CurrentPrincipal) -> MaterialOut:
    """Every route finds the material by any of its names."""
    return MaterialOut.of(curate.add_alias(context, name, alias, principal))


@router.delete(
    "/materials/{name}/aliases/{alias}",
    tags=["materials"],
    dependencies=[UPLOAD],
    summary="Take an alias away",
    status_code=204,
    responses=problems(NOT_OWNER, UNKNOWN_MATERIAL, UNKNOWN_ALIAS, INVALID_REQUEST, STORAGE_UNAVAILABLE),
)
def remove_alias(context: CurrentContext, name: str, alias: KnownAlias, principal: CurrentPrincipal) -> Response:
    """The name is free then; a material's own name is no alias."""
    curate.remove_alias(context, name, alias, principal)
    return Response(status_code=204)


@router.post(
    "/materials/{name}/merges",
    tags=["materials"],
    dependencies=[UPLOAD],
    summary="Merge another material into this one",
    responses=problems(NOT_OWNER, UNKNOWN_MATERIAL, *_BODY),
)
def merge_materials(context: CurrentContext, name: str, merge: NewMerge, principal: CurrentPrincipal) -> MergedOut:
    """Its logs and names move here, for good, and the fits are made again over all logs.

    A log that both have, by content and detector, counts once.
    """
    material, jobs = curate.merge(context, name, merge.source, principal)
    return MergedOut(material=MaterialOut.of(material), jobs=[JobOut.of(job) for job in jobs])


@router.post(
    "/materials/{name}/epochs",
    tags=["materials"],
    dependencies=[UPLOAD],
    summary="Begin a new epoch of a material",
    responses=problems(NOT_OWNER, UNKNOWN_MATERIAL, *_BODY),
)
def begin_epoch(context: CurrentContext, name: str, new: NewEpoch, principal: CurrentPrincipal) -> EpochOut:
    """Its surface is another from a log on: all logs before that are withdrawn at once, and the fits made again.

    Logs and models stay as history. Where no log is left the material has no model until the next.
    """
    material, withdrawn, jobs = curate.begin_epoch(context, name, new.reason, new.first_grasp_log, principal)
    return EpochOut(material=MaterialOut.of(material), withdrawn=withdrawn, jobs=[JobOut.of(job) for job in jobs])


@router.put(
    "/grasp-logs/{id}/withdrawal",
    tags=["grasp logs"],
    dependencies=[UPLOAD],
    summary="Withdraw a grasp log",
    responses=problems(NOT_OWNER, UNKNOWN_GRASP_LOG, QUOTA_EXCEEDED, *_BODY),
)
def withdraw_grasp_log(
    context: CurrentContext,
    id: str,  # noqa: A002  (the path's own name)
    withdrawal: NewWithdrawal,
    principal: CurrentPrincipal,
) -> WithdrawnOut:
    """It is kept, but counts in no fit from then on; its material's models are fitted again without it.

    Until then those models are marked as outdated; where no samples are left, the material has none.
    """
    return _withdrawn(context, *curate.withdraw(context, id, withdrawal.reason, principal))


@router.delete(
    "/grasp-logs/{id}/withdrawal",
    tags=["grasp logs"],
    dependencies=[UPLOAD],
    summary="Take a withdrawal back",
    responses=problems(NOT_OWNER, UNKNOWN_GRASP_LOG, QUOTA_EXCEEDED, INVALID_REQUEST, STORAGE_UNAVAILABLE),
)
def restore_grasp_log(context: CurrentContext, id: str, principal: CurrentPrincipal) -> WithdrawnOut:  # noqa: A002
    """The log counts again, and its material's models are fitted again with it."""
    return _withdrawn(context, *curate.restore(context, id, principal))


def _withdrawn(context: ServerContext, log: StoredGraspLog, jobs: list[Job]) -> WithdrawnOut:
    other = curate.counts_instead(context, log.id)
    return WithdrawnOut(grasp_log=GraspLogOut.of(log), jobs=[JobOut.of(job) for job in jobs], counts_instead=other)
