"""What half and one and a half of each default does."""
