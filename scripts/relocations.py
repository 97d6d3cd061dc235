"""How well and how quickly candles are relocated: see caregiver_mj/studies/relocations/."""

from caregiver_mj.studies.relocations.command import main

if __name__ == "__main__":
    raise SystemExit(main())
