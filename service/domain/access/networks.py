"""Where requests come from, as far as bounds and turns go by that."""

import ipaddress
from functools import lru_cache

PREFIX = 64
"""Bits of an IPv6 address that tell networks apart: the rest is a machine's to choose (RFC 4291, 2.5.4)."""
LONGEST_ADDRESS = 64
"""Characters: an IPv6 address has up to 45, and its link's name up to 16 (Linux). A proxy may pass on any text."""


def network_of(host: str) -> str:
    """Whom an address stands for: itself, or by IPv6 its network, of whose addresses one machine may use any number.

    On a machine itself, and on its link, each address is for itself. Longer texts than addresses are no addresses.
    """
    return _network(host) if len(host) <= LONGEST_ADDRESS else host


@lru_cache(maxsize=4096)
def _network(host: str) -> str:
    try:
        address = ipaddress.IPv6Address(host)
    except ValueError:
        return host
    if address.ipv4_mapped is not None:
        return str(address.ipv4_mapped)
    if address.is_loopback or address.is_link_local:
        return host
    return str(ipaddress.IPv6Network((int(address), PREFIX), strict=False))
