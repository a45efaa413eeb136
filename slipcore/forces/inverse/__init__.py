"""Forces from displacement by least squares with a prior: its strength, and which nodes bear force."""
