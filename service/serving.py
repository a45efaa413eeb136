"""How the application is served: by uvicorn, with bounds on what a connection may do."""

import importlib.util
import logging
import math
from functools import partial
from socket import socket
from typing import Any

import uvicorn

from service.app import create_app
from service.http.middleware.request_middleware import MOST_HEADER_BYTES
from service.http.protocol.connections import BoundedConnection, H11Connection
from service.http.protocol.websockets import WebSocketConnection
from service.processes import limits
from service.settings import Settings

logger = logging.getLogger(__name__)

OWN_ADDRESS = {"0.0.0.0": "127.0.0.1", "::": "::1"}
"""Of a server that listens on all addresses of the machine, the one for a browser on it."""

OWN_FILES, FILES_OF_A_CONNECTION = 200, 2
"""Files that a server has open beside its connections, of database, readers and workers; a connection is one, and the
body on its way another.
"""

MOST_MESSAGE_BYTES = 2**20
"""Of one message of the live stream: a frame of 4096 markers with forces is 200 kB."""


class Server(uvicorn.Server):
    """Says where the dashboard is, once it can be opened."""

    async def startup(self, sockets: list[socket] | None = None) -> None:
        """Begin to listen."""
        await super().startup(sockets)
        if self.started:
            logger.info("the dashboard is at %s", dashboard(self.servers[0].sockets[0].getsockname()))


def dashboard(address: tuple[Any, ...]) -> str:
    """The address of the page on a server that listens on this one."""
    host, port = OWN_ADDRESS.get(address[0], address[0]), address[1]
    return f"http://[{host}]:{port}/" if ":" in host else f"http://{host}:{port}/"


def configuration(settings: Settings, **options: Any) -> uvicorn.Config:
    """The server's configuration; ``options`` are further ones of uvicorn."""
    return uvicorn.Config(
        create_app(settings),
        host=settings.host,
        port=settings.port,
        http=partial(parsed_connection(), per_address=settings.max_connections_per_address),  # type: ignore[arg-type]
        h11_max_incomplete_event_size=MOST_HEADER_BYTES,
        limit_concurrency=_connections(settings),
        server_header=False,
        proxy_headers=bool(settings.trusted_proxies),  # by default the server would believe any proxy on this machine,
        forwarded_allow_ips=settings.trusted_proxies,  # or those of a variable that is not ours
        timeout_graceful_shutdown=max(1, math.ceil(settings.shutdown_seconds)),  # without it, clients hold the end up
        log_config=None,  # ours, service.observability: its logs, and in its metrics the record of each request
        access_log=False,
        ws=WebSocketConnection,
        ws_max_size=MOST_MESSAGE_BYTES,
        ws_per_message_deflate=False,  # noise does not pack, and packing takes its time
        **options,
    )


def _connections(settings: Settings) -> int:
    """As many at once as the settings say, or as there may be files for."""
    wanted = OWN_FILES + FILES_OF_A_CONNECTION * settings.max_connections
    allowed = limits.open_files(wanted)
    if allowed >= wanted:
        return settings.max_connections
    fitting = max((allowed - OWN_FILES) // FILES_OF_A_CONNECTION, 1)
    logger.warning(
        "%d connections at once in place of %d (STICTION_MAX_CONNECTIONS): this process may have %d files open "
        "(ulimit -Hn, LimitNOFILE=), and they take %d",
        *(fitting, settings.max_connections, allowed, wanted),
    )
    return fitting


def parsed_connection() -> type[BoundedConnection]:
    """Connections read by httptools, which takes a third of the time, or by h11 where that is not installed."""
    if importlib.util.find_spec("httptools") is None:
        return H11Connection
    from service.http.protocol.httptools_connections import HttpToolsConnection

    return HttpToolsConnection
