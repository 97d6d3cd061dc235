"""Whether the planner gets what it hopes for: see caregiver_mj/studies/value.py."""

from caregiver_mj.studies.value import main

if __name__ == "__main__":
    raise SystemExit(main())
