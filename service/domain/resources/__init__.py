"""What use cases work with: the open stores, threads and caches, and bodies on their way."""
