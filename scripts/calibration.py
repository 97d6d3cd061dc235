"""Whether what `foresight` believes of a child comes true: see caregiver_mj/studies/calibration/."""

from caregiver_mj.studies.calibration.command import main

if __name__ == "__main__":
    raise SystemExit(main())
