"""Log in with an access key, and out."""

import asyncio
from typing import Annotated

from fastapi import APIRouter, Request, Response
from fastapi.params import Form
from fastapi.responses import RedirectResponse

from service.http import origin, sessions
from service.http.dependencies import CurrentContext
from service.http.middleware.authentication import Authenticator
from service.web.forms import FormRoute
from service.web.rendering import on_problem, render


class LoginRoute(FormRoute):
    """Anybody may send its form, which is a key and a path: 3,000 characters, of up to nine bytes as they are sent."""

    most_bytes = 2**15


router = APIRouter(include_in_schema=False, route_class=LoginRoute)

SEE_OTHER = 303


@router.get("/login")
def show_login(request: Request, next: str = "/") -> Response:  # noqa: A002  (the field's own name)
    """The form that takes a key."""
    return render(request, "login.html", next=_own_path(next), problem=None)


@router.post("/login")
async def log_in(
    context: CurrentContext,
    request: Request,
    key: Annotated[str, Form(max_length=1000)] = "",
    next: Annotated[str, Form(max_length=2000)] = "/",  # noqa: A002
) -> Response:
    """Begin a session of this key; raises ``Problem`` for what is none, and for a form of another site's page."""
    origin.check_site(request, is_browser=True)
    authenticator: Authenticator = request.app.state.authenticator
    on_problem(request, "login.html", next=_own_path(next))
    found = await authenticator.find_key(request, key.strip())
    response = RedirectResponse(_own_path(next), SEE_OTHER)
    await asyncio.to_thread(sessions.begin, context.database, found, request, response)
    return response


@router.post("/logout")
async def log_out(context: CurrentContext, request: Request) -> Response:
    """End the session, if there is one; raises ``Problem`` for a form of another site's page."""
    origin.check_site(request, is_browser=True)
    response, token = RedirectResponse("/login", SEE_OTHER), sessions.sent_token(request)
    if token is not None:
        authenticator: Authenticator = request.app.state.authenticator
        authenticator.forget_session(token)
        await asyncio.to_thread(sessions.end, context.database, token, response)
    return response


def _own_path(path: str) -> str:
    """The path where to go on, if it is one of this service's pages: ``//host`` and ``/\\host`` lead elsewhere."""
    is_own = path.startswith("/") and not path.startswith(("//", "/\\")) and path.isprintable()
    return path if is_own else "/"
