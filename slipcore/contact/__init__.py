"""Contact mechanics with known truth: closed-form references and the contact simulator."""
