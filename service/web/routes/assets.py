"""Style and scripts."""

from fastapi import APIRouter, Response
from starlette.exceptions import HTTPException

from service.web.assets import find_asset

router = APIRouter(include_in_schema=False)

FOR_EVER = {"Cache-Control": "public, max-age=31536000, immutable"}


@router.get("/assets/{digest}/{name}")
async def read_asset(digest: str, name: str) -> Response:
    """A file whose content is what its address says."""
    found = find_asset(name)
    if found is None or found.digest != digest:
        raise HTTPException(404, "there is no such file")
    return Response(found.content, 200, FOR_EVER, found.content_type)
