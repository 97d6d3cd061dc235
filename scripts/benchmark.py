"""How fast everything is: see caregiver_mj/studies/benchmark/."""

from caregiver_mj.studies.benchmark.command import main

if __name__ == "__main__":
    raise SystemExit(main())
