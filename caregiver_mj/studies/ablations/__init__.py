"""Which parts of the model matter, in the grid world: prints the tables of docs/ablations.md."""
