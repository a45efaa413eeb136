"""Friction models of samples whose friction is known."""
