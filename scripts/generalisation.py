"""Experts of other houses, and children that change: see caregiver_mj/studies/generalisation/."""

from caregiver_mj.studies.generalisation.command import main

if __name__ == "__main__":
    raise SystemExit(main())
