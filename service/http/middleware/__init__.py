"""ASGI layers around all routes: who asks, in which turn, the id, bounds and headers of every request and answer."""
