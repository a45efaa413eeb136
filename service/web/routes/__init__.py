"""Pages, one module a subject: they ask the same use cases and repositories as the REST routes, and render."""
