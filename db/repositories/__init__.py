"""All queries: functions that take a session and plain values, and return plain records."""
