"""Every default of db, with unit, source and valid range."""

SQLITE_BUSY_TIMEOUT = 10.0
"""s, above 0; how long a writer waits for another: our transactions last milliseconds, a slow disk's fsync a second."""

SQLITE_SYNCHRONOUS = "FULL"
"""FULL or EXTRA: what was accepted survives a power cut; NORMAL may lose it in WAL mode (PRAGMA synchronous)."""

POOL_SIZE = 5
"""Connections kept open, at least 1."""

POOL_OVERFLOW = 45
"""Connections opened beyond that under load, at least 0: more than the 40 threads that serve requests."""

HASHES_PER_QUERY = 500
"""Hashes asked for at once, 1 to 999 (the smallest limit of SQLite on bound parameters)."""
