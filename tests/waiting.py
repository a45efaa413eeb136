import time
from collections.abc import Callable


def wait_until(condition: Callable[[], object], what: str, seconds: float = 120.0) -> None:
    """Wait for what another thread or process does; ``seconds`` are only against waiting for ever.

    It looks the more seldom the longer it waits, for a look may be a request that takes those processes' time.
    """
    began = time.monotonic()
    while not condition():
        waited = time.monotonic() - began
        assert waited < seconds, f"waited in vain for {what}"
        time.sleep(min(max(0.01, waited / 20.0), 0.1))
