"""Routes, one module a resource: they read the request, call a use case or a repository, and shape the answer."""
