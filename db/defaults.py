"""Every default of db, with unit, source and valid range."""

from datetime import timedelta

LOCK_TIMEOUT = 10.0
"""s, above 0; how long a writer waits for another: our transactions last milliseconds, a slow disk's fsync a second."""

SQLITE_SYNCHRONOUS = "FULL"
"""FULL or EXTRA: what was accepted survives a power cut; NORMAL may lose it in WAL mode (PRAGMA synchronous)."""

POOL_SIZE = 5
"""Connections that a process keeps open, at least 1."""

SQLITE_POOL_OVERFLOW = 45
"""Connections opened beyond that under load, at least 0: more than the 40 threads that serve requests."""

POSTGRESQL_POOL_OVERFLOW = 5
"""The same on PostgreSQL, at least 0: a server takes 100 connections by default, and many processes share them."""

CONNECT_TIMEOUT = 10
"""s, at least 2 (libpq); how long PostgreSQL may take to answer at all before it counts as away."""

IDLE_TRANSACTION_TIMEOUT = 60.0
"""s, above 0; PostgreSQL ends the transaction of a machine that vanished, else its row locks would stay."""

HASHES_PER_QUERY = 500
"""Hashes asked for at once, 1 to 999 (the smallest limit of SQLite on bound parameters)."""

EXPIRED_KEYS_PER_CLAIM = 10
"""Expired idempotency keys that a new one removes, at least 1: more than come in, so that none stay for ever."""

OBJECT_STORE_TIMEOUT = 20.0
"""s, above 0; how long an object store may take to answer, retries and all, before it counts as away."""

ORPHAN_AGE = timedelta(hours=24)
"""How long a blob to which nothing refers stays in its place: somebody may be about to write its row."""

QUARANTINE_AGE = timedelta(days=7)
"""How long such a blob stays in quarantine where no age is named: time to see that something is missing."""

CACHE_GRACE = 600.0
"""s, above 0; how long a blob that was just used stays in the local cache, however full: somebody may be reading it."""

COPY_BYTES = 2**20
"""Bytes of a file that are in memory at once while it is copied."""
