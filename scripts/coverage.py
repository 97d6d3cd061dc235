"""How often 95 % intervals cover the truth: see caregiver_mj/studies/coverage/."""

from caregiver_mj.studies.coverage.command import main

if __name__ == "__main__":
    raise SystemExit(main())
