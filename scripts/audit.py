"""Whether the robot kept its limits: runs an episode, or reads a logged one, and prints the worst of each."""

from __future__ import annotations

import argparse
import pathlib

from display import make_console, make_table

import caregiver_mj
from caregiver_mj.recording.audit import check_limits, near_child
from caregiver_mj.recording.telemetry import EpisodeLog
from caregiver_mj.robot.embodiments import find_embodiment


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--house", default="paper", help="name or file of a floor plan (default: paper)")
    parser.add_argument("--epsilon", type=float, default=0.5, help="share of the novice's moves that are random")
    parser.add_argument("--seed", type=int, default=0, help="seed of the episode")
    parser.add_argument("--seconds", type=float, default=340.0, help="simulated seconds (default: a whole episode)")
    parser.add_argument("--save", type=pathlib.Path, metavar="FILE.npz", help="keep the log of the episode")
    parser.add_argument("--log", type=pathlib.Path, metavar="FILE.npz", help="read a log instead of running an episode")
    args = parser.parse_args()
    if args.log:
        log = EpisodeLog.load(args.log)
    else:
        env = caregiver_mj.load("supervise", args.house, args.epsilon, random=args.seed)
        steps = round(args.seconds / env.control_timestep())
        log = EpisodeLog.record(env, caregiver_mj.CaregiverPolicy(env), steps)
    if args.save:
        log.save(args.save)

    title = f"Limits in {len(log.commands) * log.control_timestep:.0f} s"
    table = make_table(title, "", "worst", "limit", "unit", "ratio", "where", "at s")
    checks = check_limits(log, find_embodiment())
    for check in checks:
        row = (check.name, f"{check.worst:.4g}", f"{check.limit:.4g}", check.unit, f"{check.ratio:.3f}", check.where)
        table.add_row(*row, f"{check.time:.2f}", style="" if check.ratio <= 1 else "bold red")
    console = make_console()
    console.print(table)
    near = near_child(log)
    console.print(
        f"Near the child: a moving part came to {near.separation:.3f} m, one that moved towards it to "
        f"{near.approach_separation:.3f} m.\n"
        f"Within 0.5 m a part was faster than 0.25 m/s for {near.fast_seconds:.1f} s; contacts at "
        f"{near.contact_speed:.3f} m/s at most."
    )
    return int(any(check.ratio > 1 for check in checks))


if __name__ == "__main__":
    raise SystemExit(main())
