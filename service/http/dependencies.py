"""What the framework hands to the routes."""

from typing import Annotated

from fastapi import Depends, Request

from service.context import Context


async def _context(request: Request) -> Context:
    context: Context = request.app.state.context
    return context


Given = Annotated[Context, Depends(_context)]
"""The open stores and the running jobs."""
