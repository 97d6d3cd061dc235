"""A server that decides for a caregiver, to start from: it protects what is nearest to a child.

    python examples/http_caregiver.py --port 8000
    caregiver-mj evaluate --world grid --caregiver none nearest http://127.0.0.1:8000

A question and an answer are JSON, as docs/guide/caregivers.md says.
"""

from __future__ import annotations

import argparse
import json
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any


def decide(question: dict[str, Any]) -> dict[str, Any]:
    """Answer a question: of the hazards that are allowed, the one nearest to a child, as the crow flies."""
    house, now = question["house"], question["seen"][-1]
    openings = [hazard for hazard in house["hazards"] if hazard["verb"] in ("block", "close")]

    def cell_of(hazard: dict[str, Any]) -> list[int]:
        return hazard["cell"] or house["tables"][now["candle_table"][hazard["number"] - len(openings)]]

    def away(number: int) -> int:
        row, column = cell_of(house["hazards"][number])
        return min(abs(row - r) + abs(column - c) for r, c in now["child_cell"])

    target = min(question["allowed"], key=away, default=None)
    return {"target": target, "reason": "nothing can be done" if target is None else f"{away(target)} steps off"}


class Handler(BaseHTTPRequestHandler):
    """Answers questions by POST."""

    def do_POST(self) -> None:
        """Answer one question."""
        question = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
        answer = json.dumps(decide(question)).encode()
        self.send_response(200)
        self.send_header("Content-Type", "application/json")
        self.send_header("Content-Length", str(len(answer)))
        self.end_headers()
        self.wfile.write(answer)

    def log_message(self, format: str, *args: Any) -> None:
        """Say nothing of every question."""


def main() -> None:
    """Serve until Ctrl-C."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--port", type=int, default=8000, help="of 127.0.0.1 (default: %(default)s)")
    with ThreadingHTTPServer(("127.0.0.1", parser.parse_args().port), Handler) as server:
        server.serve_forever()


if __name__ == "__main__":
    main()
