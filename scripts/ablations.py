"""Which parts of the model matter, in the grid world: see caregiver_mj/studies/ablations/."""

from caregiver_mj.studies.ablations.command import main

if __name__ == "__main__":
    raise SystemExit(main())
