"""Durable jobs: their queue, who runs them, and what they do."""
