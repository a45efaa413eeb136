"""Sensors: their names, gels and faults, and what of a log follows from these."""
