"""What the service is for, one module a use case; routes call them, they call the stores."""
