"""How the results depend on what the paper leaves open: see caregiver_mj/studies/sensitivity/."""

from caregiver_mj.studies.sensitivity.command import main

if __name__ == "__main__":
    raise SystemExit(main())
