"""However much is waiting to be parsed, there is one turn of it in a round of the event loop."""

import asyncio
from collections.abc import Callable
from itertools import groupby

from service.http.protocol.turns import Turns, turns_of


def test_connections_take_turns_and_all_else_runs_between_them() -> None:
    done: list[str] = []

    async def check() -> None:
        turns, left = Turns(asyncio.get_running_loop()), {"a": 3, "b": 2, "c": 1}

        def of(name: str) -> Callable[[], None]:
            def go_on() -> None:
                done.append(name)
                left[name] -= 1
                if left[name]:
                    turns.wait(go_on)

            return go_on

        for name in left:
            turns.wait(of(name))
        while any(left.values()):
            done.append("-")
            await asyncio.sleep(0)

    asyncio.run(check())
    assert [name for name in done if name != "-"] == ["a", "b", "c", "a", "b", "a"]
    assert max(len([*same]) for name, same in groupby(done, lambda name: name == "-") if not name) == 1


def test_all_connections_of_an_event_loop_share_their_turns() -> None:
    async def mine() -> Turns:
        loop = asyncio.get_running_loop()
        assert turns_of(loop) is turns_of(loop)
        return turns_of(loop)

    assert asyncio.run(mine()) is not asyncio.run(mine())
