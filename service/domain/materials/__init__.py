"""Materials: their names, owners, logs that count, and fits."""
