"""The results that the README shows: see caregiver_mj/studies/results.py."""

from caregiver_mj.studies.results import main

if __name__ == "__main__":
    raise SystemExit(main())
