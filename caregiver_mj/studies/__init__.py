"""Studies: what the docs say that has been measured, each a command of its own."""
