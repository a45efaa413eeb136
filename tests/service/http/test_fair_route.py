"""Which routes take a turn."""

from inspect import iscoroutinefunction

from fastapi.routing import APIRoute, iter_route_contexts

from service.app import create_app
from service.http.fair_route import FairRoute


def test_every_route_that_a_thread_answers_takes_a_turn() -> None:
    in_threads = [
        context.original_route
        for context in iter_route_contexts(create_app().routes)
        if isinstance(context.original_route, APIRoute) and not iscoroutinefunction(context.original_route.endpoint)
    ]
    assert len(in_threads) > 30
    assert [route.path for route in in_threads if not isinstance(route, FairRoute)] == []
