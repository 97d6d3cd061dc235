"""Blocking in the house and in the grid: see caregiver_mj/studies/blocking.py."""

from caregiver_mj.studies.blocking import main

if __name__ == "__main__":
    raise SystemExit(main())
