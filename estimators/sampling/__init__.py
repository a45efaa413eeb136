"""Markov chain Monte Carlo by emcee near a known approximation: proposals, ensembles, convergence."""
