"""Whether the robot kept its limits in an episode: see caregiver_mj/studies/audit.py."""

from caregiver_mj.studies.audit import main

if __name__ == "__main__":
    raise SystemExit(main())
