"""Who asks for a change, with what right, and from where."""

from dataclasses import dataclass

from db.records import Actor
from service.domain.access.networks import network_of


@dataclass(frozen=True, slots=True)
class Principal:
    """An access key and its group, None where no key is asked for; ``is_admin``: what is another's may be changed, too.

    ``address`` is the network address, ``request_id`` the request's.
    """

    key_id: str | None = None
    group: str | None = None
    is_admin: bool = True
    address: str | None = None
    request_id: str | None = None

    @property
    def actor(self) -> Actor:
        """As the audit trail names it."""
        name = "anybody" if self.key_id is None else f"key:{self.key_id}"
        return Actor(name, self.address, self.request_id)

    @property
    def share(self) -> str:
        """Whose share of the server it takes: its key's, or without one its address's, or network's."""
        return self.key_id or f"address {network_of(str(self.address))}"

    @property
    def owners(self) -> tuple[str, ...]:
        """As whom it may own materials."""
        own = {"key": self.key_id, "group": self.group}
        return tuple(f"{kind}:{name}" for kind, name in own.items() if name is not None)


ANONYMOUS = Principal()
"""Where no key is asked for, everything is allowed."""
