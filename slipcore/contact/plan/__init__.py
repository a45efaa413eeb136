"""What a scene comes to for a simulation: mechanics, loads over time, sampling."""
