"""Slip found in simulated and recorded frames, against what is true."""
