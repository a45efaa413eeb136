"""One contact followed from frame to frame."""
