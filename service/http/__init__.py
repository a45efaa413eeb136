"""HTTP: routes, middleware, schemas and problems."""
