"""Two children at once: see caregiver_mj/studies/several_children.py."""

from caregiver_mj.studies.several_children import main

if __name__ == "__main__":
    main()
