"""The surface that markers show: lattice, strain and normals of frames, and the forces on it."""
