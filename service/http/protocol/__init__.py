"""The server's connections, HTTP/1.1 by either parser and WebSockets, with bounds on what a client may hold up."""
