"""Two children at once: see caregiver_mj/studies/several_children/."""

from caregiver_mj.studies.several_children.command import main

if __name__ == "__main__":
    raise SystemExit(main())
