"""What foresight is worth, and what makes it: see caregiver_mj/studies/foresight/."""

from caregiver_mj.studies.foresight.command import main

if __name__ == "__main__":
    raise SystemExit(main())
