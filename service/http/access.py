"""What a request may do, and what a route needs."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

from fastapi import Depends, FastAPI, Security
from fastapi.dependencies.models import Dependant
from fastapi.openapi.models import HTTPBearer
from fastapi.routing import iter_route_contexts
from fastapi.security import SecurityScopes
from fastapi.security.base import SecurityBase
from starlette.requests import HTTPConnection

from db.records import Scope
from service.domain.access.keys import SCOPES
from service.domain.access.principal import Principal
from service.domain.errors import InsufficientScope

CHALLENGE = 'Bearer realm="stiction"'
CHALLENGE_OF_INVALID_KEY = f'{CHALLENGE}, error="invalid_token"'
_PUBLIC_PAGES = ("/docs", "/redoc", "/login", "/logout", "/problems")
PUBLIC_PATHS = frozenset({"/healthz", "/readyz", "/openapi.json", *_PUBLIC_PAGES})
PUBLIC_FOLDERS = ("/assets/", "/problems/")
"""What anybody may see: whether the service lives, how to log in, and what is the same everywhere."""

LONGEST_ADDRESS = 100
"""Characters of a network address that the audit trail keeps: one of IPv6 with its zone has some 60."""


@dataclass(frozen=True, slots=True)
class Access:
    """What a request may do; ``key_id`` is None where no key is asked for, ``group`` where the key is of none."""

    key_id: str | None
    scope: Scope
    group: str | None = None

    def allows(self, scope: str) -> bool:
        """Whether this scope is the needed one, or implies it."""
        return SCOPES.index(self.scope) >= [*SCOPES].index(scope)  # type: ignore[arg-type]


EVERYTHING = Access(None, "admin")
NOTHING_ASKED = Access(None, "read")
"""Of who asks for what anybody may see."""


def is_public(path: str) -> bool:
    """Whether anybody may ask for this path."""
    return path in PUBLIC_PATHS or path.startswith(PUBLIC_FOLDERS)


def challenge_of_scope(needed: str) -> str:
    """What a client is answered whose key may do less than it asks for (RFC 6750)."""
    return f'{CHALLENGE}, error="insufficient_scope", scope="{needed}"'


class RequiredScope(SecurityBase):
    """The dependency of a route on a scope; the authentication before it has found out who asks."""

    scheme_name = "accessKey"
    model = HTTPBearer(description="A key of `stiction keys create`; its scope is read, upload or admin.")

    async def __call__(self, connection: HTTPConnection, needed: SecurityScopes) -> None:
        """Raise ``InsufficientScope`` unless the request has every scope of the route."""
        access: Access = connection.state.access
        for scope in needed.scopes:
            if not access.allows(scope):
                raise InsufficientScope(access.scope, scope)


_required_scope = RequiredScope()
READ, UPLOAD, ADMIN = (Security(_required_scope, scopes=[scope]) for scope in SCOPES)
"""What a route puts into its ``dependencies``."""


async def principal(connection: HTTPConnection) -> Principal:
    """Who asks, as the use cases take it."""
    access: Access = getattr(connection.state, "access", NOTHING_ASKED)
    address = connection.client.host[:LONGEST_ADDRESS] if connection.client else None
    request_id = getattr(connection.state, "request_id", None)
    return Principal(access.key_id, access.group, access.scope == "admin", address, request_id)


CurrentPrincipal = Annotated[Principal, Depends(principal)]
"""Who asks for a change, for the routes that make some."""


def scopes_of_routes(app: FastAPI) -> dict[str, set[str]]:
    """The scopes that each route needs, by method and path; none for one that nobody may leave so."""
    return {
        f"{'/'.join(sorted(route.methods or {'WS'}))} {route.path}": set(_scopes(getattr(route, "dependant", None)))
        for route in iter_route_contexts(app.routes)
        if not is_public(str(route.path))
    }


def check_routes(app: FastAPI) -> None:
    """Make sure that every route says what scope it needs; raises ``RuntimeError`` with those that do not."""
    silent = [route for route, scopes in scopes_of_routes(app).items() if not scopes & set(SCOPES)]
    if silent:
        raise RuntimeError(f"scope of {', '.join(silent)} is not said; allowed: READ, UPLOAD, ADMIN, or a public path")


def _scopes(dependant: Dependant | None) -> Iterator[str]:
    if dependant is not None:
        if isinstance(dependant.call, RequiredScope):
            yield from dependant.own_oauth_scopes or ()
        for part in dependant.dependencies:
            yield from _scopes(part)
