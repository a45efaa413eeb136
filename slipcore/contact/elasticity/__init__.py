"""How elastic bodies answer tractions: grid, influence functions, convolutions."""
