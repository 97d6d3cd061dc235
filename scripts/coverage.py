"""Prints docs/coverage.md: how often 95 % intervals cover the truth."""

from caregiver_mj.studies.coverage import main

if __name__ == "__main__":
    main()
