"""The pictures in docs/: see caregiver_mj/studies/stills.py."""

from caregiver_mj.studies.stills import main

if __name__ == "__main__":
    raise SystemExit(main())
