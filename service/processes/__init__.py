"""What processes share: starting and ending them, their memory, their folder."""
