"""What the caregiver prevents in the grid and in the house: see caregiver_mj/studies/grid_to_house/."""

from caregiver_mj.studies.grid_to_house.command import main

if __name__ == "__main__":
    raise SystemExit(main())
