"""How a candle creeps in the hand as the base turns: see caregiver_mj/studies/creep.py."""

from caregiver_mj.studies.creep import main

if __name__ == "__main__":
    raise SystemExit(main())
