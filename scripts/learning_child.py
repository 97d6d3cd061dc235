"""A child that learns, alone and with a caregiver: see caregiver_mj/studies/learning_child/."""

from caregiver_mj.studies.learning_child.command import main

if __name__ == "__main__":
    raise SystemExit(main())
