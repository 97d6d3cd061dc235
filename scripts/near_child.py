"""How the robot moves near the child: see caregiver_mj/studies/near_child.py."""

from caregiver_mj.studies.near_child import main

if __name__ == "__main__":
    raise SystemExit(main())
