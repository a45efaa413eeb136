"""Forces of a whole log or of a stream, and their comparison with a sensor's own."""
