"""Files that a page shows, made of stored ones in a reader's process, which alone loads what makes them."""

from collections.abc import Callable
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import Any

from service.domain.access.principal import Principal
from service.domain.resources.context import Context
from service.http.download import Download


async def derive(
    context: Context, principal: Principal, kind: str, write: Callable[[Path], None], **options: Any
) -> Download:
    """What ``write``, which can be pickled, writes to a path, of files of a ``kind``; ``options`` of the answer."""
    with ExitStack() as spools:
        spool = spools.enter_context(context.blobs.spool())
        await context.readers.derive(partial(write, spool.path), kind, principal.share)
        close = spools.pop_all().close
    return Download(spool.path, close, **options)
