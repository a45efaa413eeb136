"""Where requests come from, as far as bounds and turns go by that."""

import ipaddress
from functools import lru_cache

PREFIX = 64
"""Bits of an IPv6 address that tell networks apart: the rest is a machine's to choose (RFC 4291, 2.5.4)."""


@lru_cache(maxsize=4096)
def network_of(host: str) -> str:
    """Whom an address stands for: itself, or by IPv6 its network, of whose addresses one machine may use any number.

    On a machine itself, and on its link, each address is for itself.
    """
    try:
        address = ipaddress.IPv6Address(host)
    except ValueError:
        return host
    if address.ipv4_mapped is not None:
        return str(address.ipv4_mapped)
    if address.is_loopback or address.is_link_local:
        return host
    return str(ipaddress.IPv6Network((int(address), PREFIX), strict=False))
