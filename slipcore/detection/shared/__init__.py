"""What every detection method needs of a frame: surface, strain, noise, contact, rigid motion."""
