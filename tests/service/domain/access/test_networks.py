"""Whom an address stands for."""

import pytest

from service.domain.access import networks
from service.domain.access.networks import network_of
from service.domain.access.principal import Principal


@pytest.mark.parametrize(
    ("host", "network"),
    [
        ("10.0.0.7", "10.0.0.7"),
        ("2001:db8:1:2:3:4:5:6", "2001:db8:1:2::/64"),
        ("2001:db8:1:2::", "2001:db8:1:2::/64"),
        ("2001:db8:1:3::", "2001:db8:1:3::/64"),
        ("fd00:1::b", "fd00:1::/64"),
        ("::ffff:10.0.0.7", "10.0.0.7"),
        ("::1", "::1"),
        ("fe80::1%eth0", "fe80::1%eth0"),
        ("fe80::2", "fe80::2"),
        ("testclient", "testclient"),
        ("", ""),
    ],
)
def test_an_ipv6_address_stands_for_its_network(host: str, network: str) -> None:
    """Of which one machine may use any number of addresses, each with bounds and turns of its own."""
    assert network_of(host) == network


def test_shares_are_of_keys_or_else_of_networks() -> None:
    one, other = (Principal(address=f"fd00:1::{k}") for k in (1, 2))
    assert one.share == other.share == "address fd00:1::/64"
    assert Principal("a" * 12, address="fd00:1::1").share == "a" * 12
    assert one.actor.address == "fd00:1::1"


def test_what_is_longer_than_an_address_is_not_kept() -> None:
    """Forwarded addresses are what a trusted proxy passes on, which may be thousands of characters of a stranger's."""
    known = networks._network.cache_info().currsize
    assert network_of("a" * 65) == "a" * 65
    assert networks._network.cache_info().currsize == known
