"""The web service: routes, use cases, jobs, file formats and the `stiction` command line."""
