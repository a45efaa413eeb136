"""Forces reconstructed from displacement, against those that are true."""
