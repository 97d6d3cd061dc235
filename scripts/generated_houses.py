"""Whether generated houses work: see caregiver_mj/studies/generated_houses.py."""

from caregiver_mj.studies.generated_houses import main

if __name__ == "__main__":
    raise SystemExit(main())
