"""Likelihoods that emcee samples, one a file; each gives a ``Posterior`` in whitened coordinates."""
