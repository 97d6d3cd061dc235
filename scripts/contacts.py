"""What the robot does to the child by touch: see caregiver_mj/studies/contacts.py."""

from caregiver_mj.studies.contacts import main

if __name__ == "__main__":
    raise SystemExit(main())
