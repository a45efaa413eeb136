"""What the framework hands to the routes."""

from typing import Annotated

from fastapi import Depends, Request

from service.http.context import ServerContext


async def _context(request: Request) -> ServerContext:
    context: ServerContext = request.app.state.context
    return context


CurrentContext = Annotated[ServerContext, Depends(_context)]
"""The open stores and the running jobs."""
