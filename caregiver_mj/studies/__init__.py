"""Studies: what to run in order to know something about the project, each with a thin command in scripts/."""
