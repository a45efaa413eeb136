"""Whose a material is."""

from typing import Annotated

from fastapi import APIRouter, Path, Response

from service.domain.materials import ownership
from service.http.access import READ, UPLOAD, CurrentPrincipal
from service.http.dependencies import CurrentContext
from service.http.descriptions import problems
from service.http.fair_route import FairRoute
from service.http.problems import (
    INVALID_REQUEST,
    NOT_OWNER,
    QUOTA_EXCEEDED,
    STORAGE_UNAVAILABLE,
    UNKNOWN_MATERIAL,
    UNKNOWN_OWNER,
)
from service.http.schemas.owners import OWNER_PATTERN, OWNER_RULE, OwnersOut

router = APIRouter(prefix="/v1/materials/{name}/owners", tags=["materials"], route_class=FairRoute)

Owner = Annotated[
    str,
    Path(
        pattern=OWNER_PATTERN,
        description=OWNER_RULE,
        examples=["key:3f9c2a7b51de"],
    ),
]
_ALWAYS = (UNKNOWN_MATERIAL, INVALID_REQUEST, STORAGE_UNAVAILABLE)


@router.get("", dependencies=[READ], summary="Look at a material's owners", responses=problems(*_ALWAYS))
def list_owners(context: CurrentContext, name: str) -> OwnersOut:
    """Without any, whoever has the scope may add to it, and admins change it."""
    return OwnersOut(owners=ownership.list_owners(context, name))


@router.put(
    "/{owner}",
    dependencies=[UPLOAD],
    summary="Let another own a material",
    responses=problems(NOT_OWNER, QUOTA_EXCEEDED, *_ALWAYS),
)
def add_owner(context: CurrentContext, name: str, owner: Owner, principal: CurrentPrincipal) -> OwnersOut:
    """For its owners, and admins."""
    return OwnersOut(owners=ownership.add_owner(context, name, owner, principal))


@router.delete(
    "/{owner}",
    dependencies=[UPLOAD],
    summary="Take a material from an owner",
    status_code=204,
    responses=problems(NOT_OWNER, UNKNOWN_OWNER, *_ALWAYS),
)
def remove_owner(context: CurrentContext, name: str, owner: Owner, principal: CurrentPrincipal) -> Response:
    """For its owners, and admins. Without any owner the scope alone decides again."""
    ownership.remove_owner(context, name, owner, principal)
    return Response(status_code=204)
