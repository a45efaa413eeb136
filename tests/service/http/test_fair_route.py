"""Which routes take a turn."""

from inspect import iscoroutinefunction

from fastapi.routing import APIRoute

from service.app import create_app
from service.http.access import is_public
from service.http.fair_route import FairRoute


def test_every_route_that_a_thread_answers_takes_a_turn_but_those_that_anybody_may_ask() -> None:
    unfair = {
        route.path
        for route in create_app().routes
        if isinstance(route, APIRoute) and not isinstance(route, FairRoute) and not iscoroutinefunction(route.endpoint)
    }
    assert unfair
    assert all(is_public(path) for path in unfair)
