"""The moving picture of the README: see caregiver_mj/studies/gif.py."""

from caregiver_mj.studies.gif import main

if __name__ == "__main__":
    raise SystemExit(main())
