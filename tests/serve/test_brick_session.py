"""The websocket `/bricks`: order, windows, budgets, caches, and the codes with which it closes."""

import json
from contextlib import contextmanager, suppress
from threading import Event

import numpy as np
import pytest
from websockets.exceptions import ConnectionClosed

from stereocell.formats import voxel_bvh
from stereocell.serve import brick_library, brick_session, frame_window
from support.server.brick_bundles import phantom, replace_volume, write_out
from support.server.brick_client import BrickClient, look_at, psnr, reconstruct
from support.server.running import serving
from support.server.timeouts import PATIENCE_S, connect

VOLUME = phantom()
HELLO = {"type": "hello", "version": 1}
CD31 = {"tile": "r0_c0", "channel": "CD31"}
NOISE = {"tile": "r0_c1", "channel": "CD31"}  # 300 kB that don't compress
CAMERA = look_at((44, -36, 300), (44, -36, 29))


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    folder = write_out(tmp_path_factory.mktemp("bricks") / "out", VOLUME)
    noise = np.random.default_rng(2).integers(1, 256, (66, 66, 66), dtype=np.uint8)
    replace_volume(folder / "bundle", noise, tile="r0_c1")
    return folder


@pytest.fixture(scope="module")
def port(out):
    with serving(out) as server:
        yield server.port


class Talk:
    """A websocket and a client's state."""

    def __init__(self, socket):
        self.socket = socket
        self.client = BrickClient()
        self.acks = True
        self.tables = {}
        self.frames = 0

    def say(self, message):
        self.socket.send(message if isinstance(message, str) else json.dumps(message))

    def step(self):
        """Take one message in; return it if it is text."""
        data = self.socket.recv(timeout=PATIENCE_S)
        self.frames += isinstance(data, bytes)
        for answer in self.client.take(data, self.tables):
            if self.acks:
                self.say(answer)
        return json.loads(data) if isinstance(data, str) else None

    def until(self, kind):
        while True:
            message = self.step()
            if message is not None and message["type"] == kind:
                return message

    def open(self, volume=CD31, **more):
        self.say({"type": "open", "volumes": [{**volume, **more}]})
        number = self.until("tree")["tree"]
        while not self.client.is_ready(number):
            self.step()
        return number

    def look(self, id=1, trees=(0,), budget=1 << 30, texel_px=0, camera=CAMERA, **more):
        message = {"type": "view", "id": id, "trees": list(trees), "budget": budget}
        self.say(message | {"pixels_per_radian": 500, "texel_px": texel_px} | camera | more)

    def closed(self):
        """Return code and reason of the close that comes."""

        def read_on():
            while True:
                self.step()

        with pytest.raises(ConnectionClosed) as closed:
            read_on()
        return closed.value.rcvd.code, closed.value.rcvd.reason


@contextmanager
def talk(port, hello=HELLO):
    with connect(f"ws://localhost:{port}/bricks", compression=None) as socket:
        talking = Talk(socket)
        if hello is not None:
            talking.say(hello)
            assert talking.step()["type"] == "welcome"
        yield talking


def test_a_view_of_the_whole_volume_gets_all_its_bricks(port):
    with talk(port) as t:
        tree = t.open()
        t.look()
        done = t.until("done")
        found = t.client.trees[tree]
        assert done["reason"] == "complete"
        assert (done["bricks"], done["bytes"]) == (len(found.frames), t.client.brick_bytes)
        assert done["bytes"] == found.table.brick_bytes == found.message["brick_bytes"]
        assert done["bricks"] == found.message["bricks"]
        again = reconstruct(found.table, found.frames)
        differs = again != VOLUME
        assert VOLUME[differs].max(initial=0) <= found.table.threshold
        assert again[differs].max(initial=0) <= found.table.threshold


def test_the_picture_gets_better_with_every_part_of_the_bytes(port):
    with talk(port) as t:
        tree = t.open()
        total = t.client.trees[tree].table.brick_bytes
        curve = []
        for id, share in enumerate((0.05, 0.2, 0.5, 0.8, 1), 1):
            t.look(id, budget=int(share * total) - t.client.brick_bytes + 1)
            t.until("done")
            found = t.client.trees[tree]
            curve.append(psnr(reconstruct(found.table, found.frames), VOLUME))
        assert (np.diff(curve) > 0).all()
        assert curve[-1] > 60


def test_a_brick_is_sent_after_its_coarser_parent(port):
    with talk(port) as t:
        tree = t.open()
        t.look()
        t.until("done")
        parents = np.repeat(
            np.arange(len(t.client.trees[tree].table.nodes)),
            np.bitwise_count(t.client.trees[tree].table.nodes["child_mask"]),
        )
        nodes = [node for _, _, node in t.client.order]
        when = {node: i for i, node in enumerate(nodes)}
        assert nodes[0] == 0
        assert all(when[parents[n - 1]] < when[n] for n in nodes[1:])
        assert len(set(nodes)) == len(nodes)


def test_a_view_stays_within_its_budget_and_the_next_view_continues(port):
    with talk(port) as t:
        tree = t.open()
        total = t.client.trees[tree].table.brick_bytes
        for id in (1, 2):
            before = t.client.brick_bytes
            t.look(id, budget=20_000)
            done = t.until("done")
            assert done["reason"] == "budget"
            assert 10_000 < done["bytes"] == t.client.brick_bytes - before <= 20_000
        t.look(3)
        assert t.until("done")["reason"] == "complete"
        assert t.client.brick_bytes == total  # no brick was sent twice
        t.look(4, budget=0)
        assert t.until("done") | {"view": 0} == {
            **{"type": "done", "view": 0, "reason": "complete"},
            **{"bricks": 0, "bytes": 0},
        }


def test_a_client_that_acknowledges_nothing_gets_at_most_its_window(port):
    with talk(port, {**HELLO, "window": 65536}) as t:
        t.open(NOISE)
        t.acks = False
        t.look(1)
        unacked = 0
        with suppress(TimeoutError):
            while unacked < 1 << 18:
                data = t.socket.recv(timeout=0.4)
                unacked += len(data)
                t.client.take(data)
        assert 30_000 < unacked <= 65536
        t.acks = True
        before = t.client.brick_bytes
        t.say({"type": "ack", "sequence": 1000_000})
        assert t.closed()[0] == 1008
        assert t.client.brick_bytes == before


def test_an_acknowledgement_lets_the_server_send_as_many_bytes_more(port):
    with talk(port, {**HELLO, "window": 65536}) as t:
        t.open(NOISE)
        t.look(1)
        assert t.until("done")["reason"] == "complete"
        assert t.client.brick_bytes > 3 * 65536


def test_a_cancelled_view_ends_after_the_frames_that_were_sent(port):
    with talk(port, {**HELLO, "window": 65536}) as t:
        t.open(NOISE)
        t.look(1)
        t.say({"type": "cancel", "id": 1})
        done = t.until("done")
        assert done["reason"] == "cancelled"
        assert done["bytes"] == t.client.brick_bytes <= 65536
        t.look(2, budget=0)
        assert t.until("done")["view"] == 2


def fill(t):
    """Take all messages that the server sends without an acknowledgement."""
    t.acks = False
    with suppress(TimeoutError):
        while True:
            data = t.socket.recv(timeout=0.3)
            t.frames += isinstance(data, bytes)
            t.client.take(data)


def test_a_frame_that_waits_for_the_window_is_dropped_with_its_view(port):
    with talk(port, {**HELLO, "window": 65536}) as t:
        t.open(NOISE)
        t.look(1)
        fill(t)
        assert t.client.brick_bytes > 30_000
        frames = t.frames
        t.say({"type": "cancel", "id": 1})
        t.say({"type": "ack", "sequence": frames})
        done = t.until("done")
        assert done["reason"] == "cancelled"
        assert (t.frames, done["bytes"]) == (frames, t.client.brick_bytes)


def test_bricks_that_the_client_then_finds_in_its_cache_are_not_sent(port):
    with talk(port, {**HELLO, "window": 65536}) as t:
        tree = t.open(NOISE)
        t.look(1)
        fill(t)
        stored = np.flatnonzero(t.client.trees[tree].table.nodes["length"])
        t.client.trees[tree].frames = dict.fromkeys(stored.tolist(), b"")
        t.say(t.client.have(tree))
        t.acks = True
        t.say({"type": "ack", "sequence": t.frames})
        assert t.until("done")["reason"] == "complete"
        assert t.client.brick_bytes < 2 * 65536  # the frames that were already sent, and one more


def test_a_connection_closes_after_a_full_window_without_an_acknowledgement(port, monkeypatch):
    monkeypatch.setattr(frame_window, "ACK_S", 0.1)
    with talk(port, {**HELLO, "window": 65536}) as t:
        t.open(NOISE)
        t.acks = False
        t.look(1)
        assert t.closed() == (1008, "no ack within 0.1 s")


def test_a_new_view_ends_the_view_before_it(port):
    with talk(port, {**HELLO, "window": 65536}) as t:
        t.open(NOISE)
        for id in (1, 2, 3):
            t.look(id)
        while 3 not in t.client.done:
            t.step()
        ends = [(d["view"], d["reason"]) for d in t.client.messages if d["type"] == "done"]
        assert ends == [(1, "cancelled"), (2, "cancelled"), (3, "complete")]
        nodes = [node for _, _, node in t.client.order]
        assert len(nodes) == len(set(nodes)) == t.client.trees[0].message["bricks"]
        views = [view for view, _, _ in t.client.order]
        assert views == sorted(views)
        assert sum(d["bytes"] for d in t.client.done.values()) == t.client.brick_bytes


def test_cancelling_another_view_does_nothing(port):
    with talk(port) as t:
        t.open()
        t.look(5)
        t.say({"type": "cancel", "id": 4})
        assert t.until("done")["reason"] == "complete"


def test_a_client_that_stalls_holds_up_no_other_client(port):
    with talk(port, {**HELLO, "window": 65536}) as stalled, talk(port) as other:
        stalled.open(NOISE)
        stalled.acks = False
        stalled.look(1)
        other.open(NOISE)
        other.look(1)
        assert other.until("done")["reason"] == "complete"


def test_building_the_brick_tree_of_a_volume_holds_up_no_other_client(port, monkeypatch):
    go_on = Event()

    def build(*arguments):
        assert go_on.wait(20)
        return voxel_bvh.build(*arguments)

    monkeypatch.setattr(brick_library, "build", build)
    hoechst = {"tile": "r0_c0", "channel": "Hoechst_x20_33342"}
    with talk(port) as waiting, talk(port) as other:
        waiting.say({"type": "open", "volumes": [hoechst]})
        other.open(CD31)
        other.look(1)
        assert other.until("done")["reason"] == "complete"
        assert waiting.client.trees == {}
        go_on.set()
        assert waiting.until("tree")["channel"] == hoechst["channel"]


def test_a_second_visit_loads_no_bytes_again(port):
    with talk(port) as t:
        tree = t.open()
        t.look()
        t.until("done")
        first = t.client
    with talk(port) as t:
        known = first.trees[tree]
        t.tables = {known.message["table"]: bytes(known.raw)}
        number = t.open(table=known.message["table"])
        t.client.trees[number].frames = known.frames
        t.say(t.client.have(number))
        t.look()
        done = t.until("done")
        assert (done["reason"], done["bytes"]) == ("complete", 0)
        assert t.frames == t.client.brick_bytes == t.client.table_bytes == 0


def test_bricks_that_the_client_dropped_are_sent_again(port):
    with talk(port) as t:
        tree = t.open()
        t.look()
        t.until("done")
        frames = t.client.trees[tree].frames
        kept = dict(frames)
        lost = sorted(frames)[3:8]
        for node in lost:
            del frames[node]
        t.say(t.client.have(tree))
        t.look(2)
        assert t.until("done")["bricks"] == len(lost)
        assert frames == kept


def test_unknown_volumes_are_reported_and_the_connection_continues(port):
    with talk(port) as t:
        t.say({"type": "open", "volumes": [{"tile": "r9_c9", "channel": "CD31"}]})
        error = t.until("error")
        assert (error["code"], error["tile"]) == ("unknown", "r9_c9")
        t.open()
        t.look()
        assert t.until("done")["reason"] == "complete"


def test_a_damaged_volume_is_logged_in_full_and_reported_without_folders(tmp_path, caplog):
    out = write_out(tmp_path / "out", VOLUME)
    (out / "bundle/volumes/r0_c0/CD31.ktx2").write_bytes(b"damaged")
    with serving(out) as server, talk(server.port) as t:
        t.say({"type": "open", "volumes": [CD31]})
        error = t.until("error")
        assert error["code"] == "damaged"
        assert str(tmp_path) not in error["message"]
        (out / "bundle/manifest.json").unlink()
        t.say({"type": "open", "volumes": [CD31]})
        assert t.until("error")["code"] == "damaged"
    assert "CD31.ktx2: its SHA-256 is not the manifest's" in caplog.text
    assert "Traceback" not in caplog.text


def test_two_trees_in_a_view_are_both_sent(port):
    with talk(port) as t:
        trees = [t.open()]
        trees.append(t.open(NOISE))
        t.look(1, trees)
        assert t.until("done")["reason"] == "complete"
        assert all(0 in t.client.trees[n].frames for n in trees)


def test_a_replaced_bundle_ends_the_connection(tmp_path):
    out = write_out(tmp_path / "out", VOLUME)
    with serving(out) as server, talk(server.port) as t:
        t.open()
        replace_volume(out / "bundle", 255 - VOLUME)
        t.look()
        code, reason = t.closed()
        assert (code, reason) == (1012, "the bundle was replaced: connect again")


VIEW = {"type": "view", "id": 1, "trees": [0], "pixels_per_radian": 500, "texel_px": 1, "budget": 9}


@pytest.mark.parametrize(
    ("messages", "code", "reason"),
    [
        ([{"type": "ack", "sequence": 1}], 1008, "ack before hello"),
        ([{"type": "hello", "version": 2}], 1008, "version 2, expected 1"),
        ([HELLO, HELLO], 1008, "a second hello"),
        ([HELLO, {**VIEW, **CAMERA}], 1008, "tree 0 is not open"),
        ([HELLO, {"type": "have", "tree": 0, "nodes": ""}], 1008, "tree 0 is not open"),
        ([HELLO, {"type": "ack", "sequence": 1}], 1008, "ack of frame 1, the last one was 0"),
        ([HELLO, {"type": "ack"}], 1007, "ack: $: required does not match the schema"),
        ([HELLO, "{"], 1007, "not JSON"),
        ([HELLO, {"type": "open", "volumes": [CD31] * 65}], 1007, "maxItems"),
        ([HELLO] + [{"type": "open", "volumes": [CD31] * 64}] * 17, 1008, "more than 1024 trees"),
        ([HELLO] + [{"type": "cancel", "id": 1}] * 400, 1008, "more than 100 messages a second"),
    ],
)
def test_the_connection_of_a_client_that_breaks_the_rules_closes_with_a_reason(
    port, messages, code, reason
):
    with talk(port, None) as t:
        with suppress(ConnectionClosed):
            for message in messages:
                t.say(message)
        found = t.closed()
        assert found[0] == code
        assert reason in found[1]


def test_a_damaged_list_of_bricks_closes_the_connection(port):
    for nodes, reason in (("!!!!", "have"), ("AAA", "not base64"), ("AAAA", "3 bytes for")):
        with talk(port) as t:
            tree = t.open()
            t.say({"type": "have", "tree": tree, "nodes": nodes})
            code, found = t.closed()
            assert code == 1007
            assert reason in found


def test_a_binary_frame_closes_the_connection(port):
    with talk(port) as t:
        t.socket.send(b"\x01\x02")
        assert t.closed() == (1003, "a client may send text only, not binary frames")


def test_a_silent_client_is_disconnected(port, monkeypatch):
    monkeypatch.setattr(brick_session, "HELLO_S", 0.05)
    with talk(port, None) as t:
        assert t.closed() == (1008, "no hello within 0.05 s")


def test_connections_beyond_the_limit_are_refused(port, monkeypatch):
    monkeypatch.setattr(brick_session, "MAX_CONNECTIONS", 1)
    with talk(port), talk(port, None) as two:
        assert two.closed() == (1013, "1 connections are open, try again later")


def test_messages_of_the_server_fit_the_schema(port):
    from jsonschema import Draft202012Validator

    from stereocell.storage.assets import schema_path

    schema = json.loads(schema_path("brick_stream.schema.json").read_text("utf-8"))
    validator = Draft202012Validator({"$defs": schema["$defs"], **schema["$defs"]["ServerMessage"]})
    with talk(port) as t:
        t.open()
        t.say({"type": "open", "volumes": [{"tile": "r9_c9", "channel": "CD31"}]})
        t.until("error")
        t.look()
        t.until("done")
        assert {m["type"] for m in t.client.messages} == {"welcome", "tree", "error", "done"}
        for message in t.client.messages:
            validator.validate(message)
