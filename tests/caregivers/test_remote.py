"""Caregivers that ask a server: one that answers as a caregiver of the package, and one that does all that is wrong."""

import base64
import gzip
import hashlib
import http.server
import io
import json
import re
import threading
import time

import numpy as np
import pytest
from PIL import Image

from caregiver_mj import CaregiverError, CaregiverPolicy, FloorPlan
from caregiver_mj.caregivers import remote
from caregiver_mj.caregivers import server as servers
from caregiver_mj.caregivers.answers import kept, replayed
from caregiver_mj.caregivers.paper import PaperCaregiver
from caregiver_mj.caregivers.percept import Percept
from caregiver_mj.caregivers.registry import make_caregiver
from caregiver_mj.caregivers.server import Queries
from caregiver_mj.cli import main
from caregiver_mj.experiments.evaluation import evaluate
from caregiver_mj.experiments.settings import Settings
from caregiver_mj.experiments.spec import episode_streams
from caregiver_mj.grid.world import GridWorld
from caregiver_mj.tasks import load

pytest.importorskip("openai")


CELLS = ("child_cell", "previous_cell", "candle_cell")


class Model:
    """Answers as the paper's rule does, by what it is told."""

    def __init__(self):
        self.caregivers = {}

    def answer(self, question):
        house = question["house"]
        plan = FloorPlan.parse("\n".join(house["rows"]), house["name"], house["cell_size"])
        own = self.caregivers.get(question["episode"])
        if own is None:
            own = self.caregivers[question["episode"]] = PaperCaregiver(plan)
            own.reset(1, None, len(question["seen"][0]["child_cell"]))
        for seen in question["seen"]:
            percept = self.percept(plan, seen)
            if seen.get("moved"):
                own.watch(percept)
        target = own.decide(percept)[0].hazard
        return {"target": None if target < 0 else target, "reason": "it is dangerous"}

    @staticmethod
    def percept(plan, seen):
        def cell(place):
            return -1 if place is None else plan.cell_index[tuple(place)]

        known = {name: seen[name] for name in ("previous_action", "candle_table", "holding")}
        known |= {name: [*map(cell, seen[name])] for name in CELLS if name in seen}
        known["caregiver_cell"] = cell(seen["caregiver_cell"])
        masks = {name: np.array([seen[name]], bool) for name in ("out_of_reach", "shut", "gone") if name in seen}
        return Percept(**masks, **{name: np.array([value], int) for name, value in known.items()})


GRID = ["evaluate", "--world", "grid", "--epsilon", "0.5", "--episodes", "1"]
FINE = b'{"target": null}'
FAULTS = {
    # Of the first three nothing is wrong but that they come late, or have no end.
    "stalls": lambda handler: (time.sleep(5.0), handler.say(FINE)),
    "dribbles": lambda handler: handler.say(FINE + b" " * 300, pause=0.02),
    "no end": lambda handler: handler.say(FINE + b" " * 2_000_000),
    "cuts off": lambda handler: handler.say(b'{"target"', length=500),
    "says nothing": lambda handler: None,
    "fails": lambda handler: handler.say(b"{}", status=500),
    "leads elsewhere": lambda handler: handler.say(b"{}", status=302),
    "garbage": lambda handler: handler.say(b"\xff\x00{]"),
    "no object": lambda handler: handler.say(b"[0]"),
    "no target": lambda handler: handler.say(b'{"reason": "none"}'),
    "no hazard": lambda handler: handler.say(b'{"target": 999}'),
    "no number": lambda handler: handler.say(b'{"target": true}'),
    "no table": lambda handler: handler.say(b'{"target": null, "table": -1}'),
    "no depth": lambda handler: handler.say(b"[" * 100_000),
    "no HTTP": lambda handler: handler.wfile.write(b"hello\r\n\r\n"),
}
IN_A_CHAT = {"no choice": [], "no words": [{"message": {"content": None}}], "prose": [{"message": {"content": "S1!"}}]}


class Handler(http.server.BaseHTTPRequestHandler):
    model = None  # set for each server
    asked = ()

    def do_POST(self):
        body = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
        self.asked.append((dict(self.headers), body))
        fault, _, path = self.path.lstrip("/").replace("%20", " ").partition("/")
        if fault in FAULTS:
            FAULTS[fault](self)
        elif fault in IN_A_CHAT:
            self.say(json.dumps({"choices": IN_A_CHAT[fault]}).encode())
        elif path.endswith("chat/completions"):
            content = body["messages"][1]["content"]
            text = content if isinstance(content, str) else content[0]["text"]
            answer = json.dumps(self.model.answer(json.loads(text)))
            choice = {"index": 0, "finish_reason": "stop", "message": {"role": "assistant", "content": answer}}
            self.say(json.dumps({"id": "1", "object": "chat.completion", "created": 0, "model": body["model"],
                                 "choices": [choice], "usage": {"prompt_tokens": 90, "completion_tokens": 10,
                                 "total_tokens": 100}}).encode())  # fmt: skip
        else:
            self.say(json.dumps(self.model.answer(body)).encode())

    def say(self, body, status=200, length=None, pause=0.0):
        self.send_response(status)
        self.send_header("Content-Type", "application/json")
        self.send_header("Content-Length", str(length or len(body)))
        self.end_headers()
        for i in range(0, len(body), 1 if pause else len(body)):
            self.wfile.write(body[i : i + (1 if pause else len(body))])
            time.sleep(pause)

    def log_message(self, *args):
        pass


class Server(http.server.ThreadingHTTPServer):
    daemon_threads = True

    def handle_error(self, request, client_address):  # whoever asked has gone
        pass


@pytest.fixture
def server(monkeypatch):
    """Somebody to ask: the address, and what was asked."""
    handler = type("Mine", (Handler,), {"model": Model(), "asked": []})
    with Server(("127.0.0.1", 0), handler) as made:
        thread = threading.Thread(target=made.serve_forever, args=(0.01,))
        thread.start()
        made.address, made.asked = f"http://127.0.0.1:{made.server_address[1]}", handler.asked
        monkeypatch.setenv("OPENAI_BASE_URL", f"{made.address}/v1")
        yield made
        made.shutdown()
        thread.join()


def after_a_move(caregiver):
    world = GridWorld(caregiver.plan, 0.5, caregiver)
    world.reset([episode_streams(1, 1)])
    world.move_children()
    return world


def rows(caregiver, house, families, folder=""):
    queries = Queries(folder=str(folder))
    found = evaluate(Settings(FloorPlan.load(house), "grid", [caregiver], families, 1, queries=queries)).episodes
    return found.drop(columns=["caregiver", "wall_seconds"])


@pytest.mark.parametrize("name", ["http", "chat"])
def test_a_model_that_answers_as_the_rule_has_its_rows(server, name):
    asks = f"{server.address}/judge" if name == "http" else "chat:some-model"
    for house, families in (("home-8", [0.5]), ("flat", ["1,.25"])) if name == "http" else (("paper", [1.0]),):
        assert rows(asks, house, families).equals(rows("expected-danger", house, families))
    if name == "http":  # it is asked again after every move of the children
        assert all(sum("moved" in seen for seen in body["seen"]) <= 1 for _, body in server.asked)
    if name == "chat":
        _, body = server.asked[-1]
        assert body["model"] == "some-model"
        assert "damage" in body["messages"][0]["content"]


def in_the_house(caregiver, seconds=12.0, sight="all", visuals=True, **queries):
    """What comes of an episode, and what was answered in it."""
    env = load("supervise", "paper", 0.5, 4, {"time_limit": seconds}, visuals=visuals, sight=sight)
    if isinstance(caregiver, str):
        caregiver = make_caregiver(caregiver, env.task.plan, 0, Queries(**queries))
    policy = CaregiverPolicy(env, caregiver)
    with kept(policy.caregiver) as answers:
        timestep = env.reset()
        while not timestep.last():
            timestep = env.step(policy(timestep))
    return env.task.outcome() | {"end": env.physics.data.qpos.tolist()}, answers()


def exchanges(folder):
    return [json.loads(line) for file in folder.glob("*.jsonl") for line in file.open()]


def picture(text):
    image = Image.open(io.BytesIO(base64.b64decode(text, validate=True)))
    assert (image.format, image.size, image.mode) == ("PNG", (320, 240), "RGB")
    pixels = np.asarray(image).astype(int)
    assert pixels.std() > 10  # there is something to be seen
    return pixels


@pytest.mark.parametrize("name", ["http", "chat"])
def test_frames_change_nothing_but_what_is_sent(server, tmp_path, name):
    asks = f"{server.address}/judge" if name == "http" else "chat:some-model"
    without, _ = in_the_house(asks, visuals=False)
    assert not any("frames" in body or "image_url" in json.dumps(body) for _, body in server.asked)
    before = len(server.asked)
    assert without == in_the_house("expected-danger", visuals=False)[0]
    with_them, answers = in_the_house(asks, frames=True, folder=str(tmp_path))
    assert with_them == without
    assert len(server.asked) == 2 * before > 8
    sent = []
    for _, body in server.asked[before:]:
        if name == "http":
            sent.append(body["frames"])
        else:
            parts = body["messages"][1]["content"]
            assert [part["type"] for part in parts] == ["text", *["text", "image_url"] * 2]
            assert "frames" not in json.loads(parts[0]["text"])
            urls = [part["image_url"]["url"].split("data:image/png;base64,") for part in parts[2::2]]
            sent.append(dict(zip(("eye", "overview"), (text for _, text in urls), strict=True)))
    eyes, overviews = ([picture(frames[camera]) for frames in sent[::6]] for camera in ("eye", "overview"))
    for pictures, least in ((eyes, 0.2), (overviews, 0.001)):  # the robot turns; the house stays where it is
        changed = [(np.abs(one - pictures[0]).max(axis=2) > 30).mean() for one in pictures[1:]]
        assert max(changed) > least
    assert np.abs(eyes[0] - overviews[0]).mean() > 30
    # A line has the names of its pictures, which lie beside it as they were sent.
    lines = exchanges(tmp_path)
    assert all(len(json.dumps(line)) < 10_000 for line in lines)
    for line, frames in zip(lines, sent, strict=True):
        files = {camera: (tmp_path / file).read_bytes() for camera, file in line["question"]["frames"].items()}
        assert files == {camera: base64.b64decode(text) for camera, text in frames.items()}
        names = [f"{hashlib.sha256(content).hexdigest()}.png" for content in files.values()]
        assert list(line["question"]["frames"].values()) == names
    # And nobody is asked, or looks, when the answers are given again.
    again, _ = in_the_house(replayed(FloorPlan.load("paper"), answers), visuals=False)
    assert again == without
    assert len(server.asked) == 2 * before


def test_who_does_not_see_everything_gets_no_view_from_above(server):
    in_the_house(f"{server.address}/judge", 2.0, "camera", frames=True)
    assert {tuple(body["frames"]) for _, body in server.asked} == {("eye",)}


def test_a_second_run_in_one_process_has_its_own_budget(server):
    command = [*GRID, "--caregiver", f"{server.address}/judge"]
    assert main([*command, "--max-calls", "0"]) == 0
    assert not server.asked
    assert main(command) == 0
    assert server.asked


def test_each_run_in_one_process_asks_its_own_server(monkeypatch):
    plan, found = FloorPlan.load("paper"), []
    for key, base_url in (("one", "http://127.0.0.1:1/v1"), ("two", "http://127.0.0.1:2/v1")):
        monkeypatch.setenv("OPENAI_API_KEY", key)
        queries = Queries(base_url, patience=5.0 if key == "one" else 6.0)
        server = make_caregiver("chat:none", plan, 0, queries).server()
        found.append((server.address, server.timeout.connect))  # of two attempts
    assert found == [("http://127.0.0.1:1/v1", pytest.approx(5 / 3)), ("http://127.0.0.1:2/v1", pytest.approx(2.0))]


def test_processes_of_a_run_without_a_folder_share_its_budget(server):
    asks = f"{server.address}/garbage"
    queries = Queries(max_calls=3)
    run = Settings(FloorPlan.load("paper"), "grid", (asks,), (1.0, 0.5), episodes=4, seed=0, queries=queries)
    evaluate(run, jobs=2, grid_block=1)
    assert len(server.asked) == 3


def test_a_run_keeps_its_exchanges_and_its_budget(server, tmp_path, capsys):
    command = [*GRID, "--max-calls", "3"]
    asks = f"{server.address}/garbage"
    assert main([*command, "--caregiver", "none", asks, "--out", str(tmp_path / "run")]) == 0
    lines = exchanges(tmp_path / "run/exchanges")
    assert len(server.asked) == 3
    assert f"{len(lines)} questions, {len(lines)} abstentions; {len(lines) - 3} x the budget" in capsys.readouterr().out


def test_a_run_is_not_continued_with_another_way_of_asking(server, tmp_path, capsys):
    command = [*GRID, "--caregiver", "none"]
    asks, folder = f"{server.address}/garbage", ["--out", str(tmp_path / "run")]
    assert main([*command, asks, *folder, "--max-calls", "3"]) == 0
    assert main([*command, asks, *folder, "--max-calls", "4", "--resume"]) == 2
    (line,) = capsys.readouterr().err.splitlines()[-1:]
    assert "holds a run of other settings: queries is {" in line
    assert len(server.asked) == 3


def test_a_model_is_asked_no_more_once_its_tokens_are_used_up(server, capsys):
    command = [*GRID, "--max-tokens", "250"]
    assert main([*command, "--caregiver", "none", "chat:some-model"]) == 0
    assert len(server.asked) == 3  # of 100 tokens each
    assert "x the budget of 250 tokens is used up" in capsys.readouterr().out


def test_the_environment_says_nothing_but_keys_and_where_models_are(monkeypatch):
    for name in ("MAX_CALLS", "MAX_TOKENS", "PATIENCE", "THINKING", "FRAMES", "EXCHANGES"):
        monkeypatch.setenv(f"CAREGIVER_MJ_{name}", "1")
    monkeypatch.setenv("OPENAI_BASE_URL", "http://127.0.0.1:1/v1")
    plan = FloorPlan.load("paper")
    assert make_caregiver("http://127.0.0.1:1", plan).queries == Queries()
    assert make_caregiver("chat:m", plan).queries == Queries("http://127.0.0.1:1/v1")
    assert Settings(plan, caregivers="chat:m").queries == Queries("http://127.0.0.1:1/v1")
    assert Settings(plan, caregivers="nearest", queries=Queries(max_calls=3)).queries == Queries()


@pytest.mark.parametrize(("thinking", "first"), [("waits", 0), ("real-time", 2)])
def test_slow_thinking_in_real_time_comes_late(monkeypatch, thinking, first):
    now = [0.0]
    monkeypatch.setattr(remote.time, "time", lambda: now[0])
    asked = []

    async def slow(caregiver, server, question):
        asked.append(question)
        now[0] += 1.0  # of 1.69 s that a child's move takes; a third of that between two decisions
        return {"target": question["allowed"][-1]}

    monkeypatch.setattr(remote.HttpCaregiver, "send", slow)
    plan = FloorPlan.load("paper")
    caregiver = make_caregiver("http://127.0.0.1:9", plan, 0, Queries(thinking=thinking))
    world = after_a_move(caregiver)
    targets = []
    for left in (1.0, 2 / 3, 1 / 3):
        world.time_left = np.array([left])
        targets += caregiver.choose(world.percept()).tolist()
        if left == 1.0:
            caregiver.watch(world.percept())  # news, about which it would be asked
    assert targets[:first] == [-1] * first
    assert targets[first:] == [asked[0]["allowed"][-1]] * (3 - first)
    assert len(asked) == 2  # in real time the second time only after the first answer has come


@pytest.mark.parametrize("fault", [*FAULTS, *IN_A_CHAT])
@pytest.mark.parametrize("name", ["http", "chat"])
def test_whatever_else_comes_is_an_abstention(server, tmp_path, monkeypatch, fault, name):
    if name == "http" and fault in IN_A_CHAT:
        pytest.skip("an answer of a chat")
    monkeypatch.setenv("OPENAI_API_KEY", "secret")
    address = asking(monkeypatch, name, f"{server.address}/{fault.replace(' ', '%20')}")
    exchange = asked_once(address, tmp_path, 0.3)
    assert exchange["abstention"]
    assert "secret" not in json.dumps(exchange)


def asked_once(address, tmp_path, patience=0.5, **queries):
    queries = Queries(patience=patience, folder=str(tmp_path / "exchanges"), **queries)
    caregiver = make_caregiver(address, FloorPlan.load("paper"), 0, queries)
    caregiver.choose(after_a_move(caregiver).percept())
    return exchanges(tmp_path / "exchanges")[-1]


def asking(monkeypatch, name, address):
    """The caregiver that asks at an address, as it is or as a model's server."""
    monkeypatch.setenv("OPENAI_BASE_URL", address)
    return address if name == "http" else "chat:m"


def fault(monkeypatch, act):
    monkeypatch.setitem(FAULTS, "fault", act)


def headers(handler, *lines, status=200):
    handler.wfile.write(f"HTTP/1.1 {status} X\r\n".encode() + "".join(f"{line}\r\n" for line in lines).encode())


LEFT = threading.Event()  # whoever asked has gone before the headers had an end


def trickle(handler):
    headers(handler)
    try:
        for _ in range(600):
            time.sleep(0.1)
            handler.wfile.write(b"X-More: 1\r\n")
    except OSError:
        LEFT.set()


@pytest.mark.parametrize("name", ["http", "chat"])
@pytest.mark.parametrize("slow", [trickle, lambda handler: headers(handler, "Retry-After: 20", "", status=429)])
def test_one_deadline_covers_headers_and_waits(server, tmp_path, monkeypatch, name, slow):
    fault(monkeypatch, slow)
    address = asking(monkeypatch, name, f"{server.address}/fault")
    LEFT.clear()
    assert asked_once(address, tmp_path)["abstention"]
    assert len(server.asked) == 1  # it has not waited to ask once more
    assert slow is not trickle or LEFT.wait(50.0)


@pytest.mark.parametrize("name", ["http", "chat"])
def test_a_compressed_answer_is_refused_before_it_is_unpacked(server, tmp_path, monkeypatch, name):
    bomb = gzip.compress(gzip.compress(bytes(100_000_000)))

    def act(handler):
        headers(handler, "Content-Encoding: gzip, gzip", f"Content-Length: {len(bomb)}", "")
        handler.wfile.write(bomb)

    fault(monkeypatch, act)
    address = asking(monkeypatch, name, f"{server.address}/fault")
    assert asked_once(address, tmp_path, 5.0)["abstention"]
    assert server.asked[0][0]["Accept-Encoding"] == "identity"


def test_requests_of_a_client_are_counted_over_resume(server, tmp_path, monkeypatch):
    fault(monkeypatch, lambda handler: handler.say(b"{}", status=500))
    for most, sent in ((1, 1), (2, 2), (2, 2)):  # with an attempt more than one each
        asked_once("chat:m", tmp_path, 60.0, base_url=f"{server.address}/fault", max_calls=most)
        assert len(server.asked) == sent


@pytest.mark.parametrize("name", ["http://127.0.0.1:9", "chat:m"])
def test_without_a_server_a_run_ends_in_a_line(monkeypatch, capsys, name):
    monkeypatch.setenv("OPENAI_BASE_URL", "http://127.0.0.1:9/v1")
    command = [*GRID, "--caregiver", "none", name]
    assert main(command) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert "no server can be reached at http://127.0.0.1:9" in err.splitlines()[-1]


def test_a_model_without_a_server_or_key_is_not_asked_anywhere(monkeypatch):
    monkeypatch.delenv("OPENAI_BASE_URL", raising=False)
    monkeypatch.delenv("OPENAI_API_KEY", raising=False)
    with pytest.raises(CaregiverError, match="chat:m requires a server"):
        make_caregiver("chat:m", FloorPlan.load("paper"))


@pytest.mark.parametrize("secret", ["http://user:hidden@h/", "https://h/x?key=hidden", "http://h/#hidden"])
def test_an_address_with_a_secret_is_refused_and_not_printed(monkeypatch, tmp_path, capsys, secret):
    command = [*GRID, "--out", str(tmp_path / "run"), "--caregiver"]
    assert main([*command, secret]) == 2
    monkeypatch.setenv("OPENAI_BASE_URL", secret)
    assert main([*command, "chat:m"]) == 2
    assert "hidden" not in "".join(capsys.readouterr())
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize(
    "address", ["http://[::1", "http://h:x", "http://a b", "http://\x00", "http:x", "http://\u202eh"]
)
def test_what_is_no_address_is_refused_in_a_line(address):
    with pytest.raises(CaregiverError, match="must be an address such as"):
        make_caregiver(address, FloorPlan.load("paper"))


@pytest.mark.parametrize("echo", ["sk-hidden-key", "sk-\\u0068idden-key"])
@pytest.mark.parametrize("place", ['{"target": "%s"}', '{"target": null, "%s": ["%s"]}', "%s"])
def test_a_key_that_a_server_echoes_is_not_kept(server, tmp_path, monkeypatch, echo, place):
    monkeypatch.setenv(servers.API_KEY, "sk-hidden-key")
    fault(monkeypatch, lambda handler: handler.say(place.replace("%s", echo).encode()))
    exchange = asked_once(f"{server.address}/fault", tmp_path, 5.0)
    assert server.asked[0][0]["Authorization"] == "Bearer sk-hidden-key"
    assert "hidden-key" not in json.dumps(exchange)
    assert "idden-key" not in json.dumps(exchange)


def test_markup_and_escapes_of_a_server_are_text(server, monkeypatch, capsys):
    fault(monkeypatch, lambda handler: handler.say(b'{"target": "[/foo]\\u001b[2J"}'))
    command = [*GRID, "--json", "--caregiver", "none"]
    assert main([*command, f"{server.address}/fault"]) == 0
    out, err = capsys.readouterr()
    assert json.loads(out)["rows"]
    assert "[/foo]" in err
    assert "\x1b" not in err


def test_a_proxy_of_the_environment_is_used_but_not_to_this_machine(server, tmp_path, monkeypatch):
    for name in ("NO_PROXY", "no_proxy", "http_proxy"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("HTTP_PROXY", "http://127.0.0.1:9")  # where nobody is
    assert asked_once(f"{server.address}/no%20target", tmp_path, 60.0)["answer"] == {"reason": "none"}
    monkeypatch.setenv("HTTP_PROXY", server.address)
    assert asked_once("http://robot.invalid/judge", tmp_path, 60.0)["abstention"] is None
    monkeypatch.setenv("HTTP_PROXY", "gopher://x")
    with pytest.raises(CaregiverError, match="proxies of the environment"):
        make_caregiver("http://robot.invalid", FloorPlan.load("paper"))


@pytest.mark.parametrize("name", ["http", "chat"])
def test_changed_answers_are_read_or_abstentions(server, tmp_path, monkeypatch, name):
    message = b'{"role": "assistant", "content": "{\\"target\\": null}"}'
    chat = b'{"choices": [{"message": %s}], "usage": {"total_tokens": 9}}' % message
    sound, random = (FINE if name == "http" else chat), np.random.RandomState(0)
    odd = [b"[" * 2000, b"9" * 5000, b"\xff", *rb'null 1e999 NaN -1 [] {} "x" \ud800 true'.split()]
    tokens = re.findall(rb"\w+|\W", sound)

    def changed():
        found = list(tokens)
        for _ in range(random.randint(1, 4)):
            place = random.randint(len(found))
            found[place : place + random.randint(2)] = [odd[random.randint(len(odd))]]
        return b"".join(found)

    fault(monkeypatch, lambda handler: handler.say(changed()))
    plan, queries = FloorPlan.load("paper"), Queries(f"{server.address}/fault", folder=str(tmp_path))
    caregiver = make_caregiver(f"{server.address}/fault" if name == "http" else "chat:m", plan, 0, queries)
    for _ in range(40):
        target = caregiver.choose(after_a_move(caregiver).percept())[0]
        assert -1 <= target < len(plan.hazards)
    lines = exchanges(tmp_path)
    assert len(lines) == 40
    assert all(len(line["abstention"] or "") < 2_000 and "\n" not in (line["abstention"] or "") for line in lines)
    assert any(line["abstention"] for line in lines)
