"""Slip from forces alone: which elements take less of a growing load than those that stick, and at what force ratio."""
