"""A gel's stiffness and thickness from presses with known forces."""
