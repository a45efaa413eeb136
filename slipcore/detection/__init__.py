"""Local slip in tactile frames: the methods, and what runs them over a stream or a whole log."""
