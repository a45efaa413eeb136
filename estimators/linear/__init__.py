"""The linear Gaussian model: checked data, triangular factors, what follows from them in closed form."""
