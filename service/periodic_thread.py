"""Work that is done again and again in a thread beside the server."""

import asyncio
import logging
import threading
from collections.abc import Callable

logger = logging.getLogger(__name__)


class PeriodicThread:
    """Calls ``step`` every so many ``seconds``; it is told to ``stop`` before a step, and can look meanwhile.

    A step that fails is logged and comes again: who waits for its work would wait for good otherwise.
    """

    def __init__(self, name: str, seconds: float, step: Callable[[], None]) -> None:
        self._seconds, self._step = seconds, step
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)

    @property
    def is_stopping(self) -> bool:
        """Whether a step is to end early."""
        return self._stopping.is_set()

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def sleep(self, seconds: float) -> bool:
        """Wait inside of a step; True, and at once, where it is to end early."""
        return self._stopping.wait(seconds)

    async def stop(self) -> None:
        """End after the present step, if it ever began."""
        self._stopping.set()
        if self._thread.ident is not None:
            await asyncio.to_thread(self._thread.join)

    def _run(self) -> None:
        while not self._stopping.wait(self._seconds):
            try:
                self._step()
            except Exception:
                logger.exception("%s: a step failed, the next is in %g s", self._thread.name, self._seconds)
