"""What the framework hands to the routes."""

from typing import Annotated

from fastapi import Depends, Request

from service.http.context import ServerContext


async def server_context(request: Request) -> ServerContext:
    """What the application of a request holds."""
    context: ServerContext = request.app.state.context
    return context


CurrentContext = Annotated[ServerContext, Depends(server_context)]
"""The open stores and the running jobs."""
