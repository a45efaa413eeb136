"""Contact patches: where an object touches, followed over time, and what the whole patch says of its friction."""
