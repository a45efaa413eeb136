"""A gel's marker displacement by the forces on its surface, as a matrix."""
