"""Grip control in closed loops."""
