"""Friction models: stored and read again, kept in memory, chosen among and compared."""
