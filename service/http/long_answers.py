"""Room for answers that hold much while they are sent, arrays in memory or a file made for them on the disk."""

from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import AsyncExitStack
from typing import Annotated

from fastapi import Depends

from service.http.access import CurrentPrincipal
from service.http.dependencies import CurrentContext

TakeRoom = Callable[[], Awaitable[None]]


async def _room(context: CurrentContext, principal: CurrentPrincipal) -> AsyncIterator[TakeRoom]:
    async with AsyncExitStack() as held:

        async def take() -> None:
            await held.enter_async_context(context.answers.turn(principal.share))

        yield take


Room = Annotated[TakeRoom, Depends(_room)]
"""What waits for room, which is held until the answer is sent, however slowly its client reads; raises ``QueueFull``.

For a route that knows late whether its answer holds much.
"""


async def _room_taken(room: Room) -> None:
    await room()


LONG_ANSWER = Depends(_room_taken)
"""Of a route whose answers all hold much: its room is taken before it begins."""
