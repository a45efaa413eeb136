"""Ways to simulate a plan, the cheapest first, and how to reach an accuracy with them."""
