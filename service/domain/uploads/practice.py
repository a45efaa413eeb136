"""Practice: the demo's simulated grasps, taken in as any other upload is."""

from collections.abc import AsyncIterator
from functools import partial
from pathlib import Path

from db.blobs import disk_errors_named
from service.demo.inputs import Ramp, ramps
from service.domain.access.principal import Principal
from service.domain.resources.context import Context
from service.domain.resources.receive import CHUNK_BYTES
from service.domain.uploads.upload import UploadRequest, upload
from stiction_client import container

SEED = 0
"""Of the noise: whoever loads the grasps once more sends the same files, which are stored already."""


async def load_practice(context: Context, principal: Principal) -> None:
    """Upload every simulated grasp to a material ``simulated …``, made known with the first; raises as ``upload``."""
    for ramp in ramps(SEED):
        await _load(context, ramp, principal)


async def _load(context: Context, ramp: Ramp, principal: Principal) -> None:
    request = UploadRequest(
        f"simulated {ramp.material}",
        None,
        None,
        container.CONTENT_TYPE,
        principal=principal,
        creates_material=True,
    )
    with context.blobs.spool() as spool:
        await context.readers.derive(partial(_write, ramp, spool.path), "simulated", principal.share)
        await upload(context, _chunks(spool.path), request)


def _write(ramp: Ramp, path: Path) -> None:
    """In a reader's process: simulate a grasp, which loads compiled kernels."""
    log = ramp.simulate()
    with disk_errors_named():
        container.write(log, path)


async def _chunks(path: Path) -> AsyncIterator[bytes]:
    with disk_errors_named(), path.open("rb") as stream:
        while chunk := stream.read(CHUNK_BYTES):
            yield chunk
