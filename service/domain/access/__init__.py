"""Who asks, what they may do and how much of it, and the record of what they changed."""
