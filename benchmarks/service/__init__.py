"""Load, uploads, streams and pages of a running service."""
