"""Studies: a module each, with the template of its page if it prints one. `scripts/study.py` runs them."""
