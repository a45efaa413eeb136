"""Slip on arrays of few elements: from forces and from displacement, joined."""
