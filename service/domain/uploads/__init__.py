"""How logs come in: taken from the wire, looked at, and stored with their job."""
