"""Speed, scale and stability: each module is a command that prints its figures."""
