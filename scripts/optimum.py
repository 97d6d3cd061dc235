"""How far caregivers are from the best that anybody could do: see caregiver_mj/studies/optimum.py."""

from caregiver_mj.studies.optimum import main

if __name__ == "__main__":
    raise SystemExit(main())
