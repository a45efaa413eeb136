"""How elastic bodies give way to tractions: grid, influence functions, convolutions."""
