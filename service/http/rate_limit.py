"""How often somebody may ask: a bucket of tokens each, which fills steadily."""

import time
from collections import OrderedDict

MOST_BUCKETS = 10_000
"""Who asked least recently is forgotten beyond that: 1 MB."""


class RateLimit:
    """Lets everybody ask ``rate`` times a second on average, and as many at once as come up in a second."""

    def __init__(self, rate: float) -> None:
        self._rate = rate
        self._most = max(rate, 1.0)
        self._buckets: OrderedDict[str, tuple[float, float]] = OrderedDict()

    def wait(self, who: str) -> float:
        """Take a token: 0, or the seconds after which there will be one."""
        if self._rate == 0.0:
            return 0.0
        now = time.monotonic()
        tokens, filled_at = self._buckets.pop(who, (self._most, now))
        tokens = min(self._most, tokens + (now - filled_at) * self._rate)
        enough = tokens >= 1.0
        self._buckets[who] = (tokens - 1.0 if enough else tokens, now)
        if len(self._buckets) > MOST_BUCKETS:
            self._buckets.popitem(last=False)
        return 0.0 if enough else (1.0 - tokens) / self._rate
