/**
 * Module worker with the websocket `/bricks`, the cache and the decoder. It sends tables and
 * unpacked bricks to the main thread.
 */
import { ZSTDDecoder } from "zstddec";
import { BrickCache, type KeptBrick } from "./cache";
import type { LinkMessage, LinkRequest } from "./client";
import { BRICKS_FRAME, type Frame, parseFrame, type ServerMessage, TABLE_FRAME } from "./protocol";
import { haveBits, hexOf, parseTable, STORED_BYTES, type Table } from "./tree";

/** Bricks in one write to the cache. */
const BATCH = 64;
const MAX_AT_ONCE = 64;
/** Milliseconds before each attempt to connect again. */
const RETRY_MS = [500, 1000, 2000, 5000, 10_000];

type Tree = {
  readonly name: string;
  readonly tile: string;
  readonly channel: string;
  readonly volume: string;
  readonly hash: string;
  readonly raw: Uint8Array<ArrayBuffer>;
  filled: number;
  table: Table | null;
  readonly present: { bits: Uint8Array };
  unkept: KeptBrick[];
  isBegun: boolean;
};

const decoder = new ZSTDDecoder();
const cache = BrickCache.open();
let address = "";
let socket: WebSocket | null = null;
let tries = 0;
let hasOpened = false;
/** The wanted volumes, to be requested again on a new connection. */
const volumes = new Map<string, Volume>();
/** The volumes that were requested on this connection. */
const requested = new Set<string>();
const trees = new Map<number, Tree>();
let view: Extract<LinkRequest, { type: "view" }> | null = null;
let viewId = 0;
/** Answers are processed one after the other. */
let turn: Promise<void> = decoder.init();

function post(message: LinkMessage, transfer: Transferable[] = []): void {
  self.postMessage(message, { transfer });
}

function send(message: object): void {
  if (socket?.readyState === WebSocket.OPEN) socket.send(JSON.stringify(message));
}

function connect(): void {
  const made = new WebSocket(address);
  made.binaryType = "arraybuffer";
  socket = made;
  made.onopen = () => send({ type: "hello", version: 1 });
  made.onmessage = ({ data }: MessageEvent<string | ArrayBuffer>) => {
    turn = turn.then(() => take(data)).catch((error: unknown) => fail(error));
  };
  made.onclose = ({ reason }) => {
    if (socket !== made) return;
    socket = null;
    trees.clear();
    requested.clear();
    // a host that never answered does not offer bricks
    const isHost = hasOpened || tries === 0;
    if (hasOpened && tries > 0) post({ type: "away", isAway: true });
    if (!isHost || tries === RETRY_MS.length) post({ type: "lost", reason });
    if (isHost) setTimeout(connect, RETRY_MS[Math.min(tries, RETRY_MS.length - 1)]);
    tries++;
  };
}

function fail(error: unknown): void {
  post({ type: "fault", text: error instanceof Error ? error.message : String(error) });
  socket?.close();
}

async function take(data: string | ArrayBuffer): Promise<void> {
  if (typeof data === "string") await handleText(JSON.parse(data) as ServerMessage);
  else {
    const frame = parseFrame(data);
    if (frame.kind === TABLE_FRAME) await takeTable(frame);
    else if (frame.kind === BRICKS_FRAME) await takeBricks(frame);
    send({ type: "ack", sequence: frame.sequence });
  }
}

async function handleText(message: ServerMessage): Promise<void> {
  if (message.type === "welcome") {
    tries = 0;
    hasOpened = true;
    post({ type: "away", isAway: false });
    if (volumes.size > 0) await open([...volumes.values()]);
  } else if (message.type === "tree") {
    const { tree, tile, channel, source, table: hash, table_bytes, table_follows } = message;
    const made: Tree = {
      name: `/bricks: ${tile}, ${channel}`,
      tile,
      channel,
      volume: `${source}/${channel}`,
      hash,
      raw: new Uint8Array(table_bytes),
      filled: 0,
      table: null,
      present: { bits: new Uint8Array(0) },
      unkept: [],
      isBegun: false,
    };
    trees.set(tree, made);
    if (!table_follows) {
      const kept = await (await cache).table(`${source}/${channel}`);
      if (kept === null || kept.hash !== hash)
        throw new Error(`${made.name}: its table is missing in the cache`);
      made.raw.set(kept.bytes);
      made.filled = table_bytes;
      await begin(tree, made);
    }
  } else if (message.type === "error") {
    const { tile, channel } = message;
    volumes.delete(`${tile}/${channel}`);
    post({ type: "refused", tile, channel, text: message.message });
  } else if (message.type === "done") {
    for (const tree of trees.values()) await flush(tree);
    if (message.view !== viewId || message.reason === "cancelled") return;
    if (message.reason === "budget")
      // the view needs more bricks than one answer may hold, so the rest is requested
      requestView();
    else if (readyTrees().length >= volumes.size) post({ type: "done" });
  }
}

async function hashOf(bytes: Uint8Array<ArrayBuffer>): Promise<string> {
  const digest = await crypto.subtle.digest("SHA-256", bytes);
  return hexOf(new Uint8Array(digest, 0, 16));
}

async function takeTable({ parts }: Frame): Promise<void> {
  for (const { tree: number, at, bytes } of parts) {
    const tree = trees.get(number);
    if (tree === undefined) continue;
    const part = decoder.decode(bytes, tree.raw.length - at);
    if (at !== tree.filled || at + part.length > tree.raw.length) {
      throw new Error(`${tree.name}: its table arrived out of order`);
    }
    tree.raw.set(part, at);
    tree.filled += part.length;
    if (tree.filled < tree.raw.length) continue;
    if ((await hashOf(tree.raw)) !== tree.hash)
      throw new Error(`${tree.name}: its table is damaged`);
    await (await cache).keepTable(tree.volume, tree.hash, tree.raw);
    await begin(number, tree);
  }
}

/** Called when a table is complete: passes on its bricks from the cache. */
async function begin(number: number, tree: Tree): Promise<void> {
  const table = parseTable(tree.raw, tree.name);
  tree.table = table;
  tree.present.bits = new Uint8Array(table.nodes.length);
  post({ type: "tree", tile: tree.tile, channel: tree.channel, table: tree.raw.slice() });
  const byHash = new Map<string, Uint8Array<ArrayBuffer>>();
  for (const { hash, bytes } of await (await cache).bricks(tree.hash)) byHash.set(hash, bytes);
  const wasOpen = tree.isBegun;
  tree.isBegun = true;
  if (byHash.size > 0 || wasOpen) {
    const found: Kept[] = [];
    table.nodes.forEach(({ hash }, node) => {
      const bytes = byHash.get(hash);
      if (bytes === undefined) return;
      tree.present.bits[node] = 1;
      found.push({ node, bytes });
    });
    sendBricks(tree, found);
    send({ type: "have", tree: number, nodes: haveBits(tree.present.bits) });
  }
  requestView();
}

type Kept = Readonly<{ node: number; bytes: Uint8Array }>;

function sendBricks({ tile, channel, name }: Tree, bricks: readonly Kept[]): void {
  const nodes = new Uint32Array(bricks.length);
  const texels = new Uint8Array(bricks.length * STORED_BYTES);
  bricks.forEach(({ node, bytes }, i) => {
    const unpacked = decoder.decode(bytes, STORED_BYTES);
    if (unpacked.length !== STORED_BYTES) throw new Error(`${name}: a brick is damaged`);
    nodes[i] = node;
    texels.set(unpacked, i * STORED_BYTES);
  });
  post({ type: "bricks", tile, channel, nodes, texels }, [nodes.buffer, texels.buffer]);
}

async function takeBricks({ parts }: Frame): Promise<void> {
  const byTree = new Map<Tree, Kept[]>();
  for (const { tree: number, at: node, bytes } of parts) {
    const tree = trees.get(number);
    const expected = tree?.table?.nodes[node]?.hash;
    if (tree === undefined || expected === undefined) continue;
    const copy = bytes.slice();
    if ((await hashOf(copy)) !== expected) throw new Error(`${tree.name}: a brick is damaged`);
    tree.present.bits[node] = 1;
    tree.unkept.push({ hash: expected, table: tree.hash, bytes: copy });
    byTree.set(tree, [...(byTree.get(tree) ?? []), { node, bytes: copy }]);
  }
  for (const [tree, bricks] of byTree) {
    sendBricks(tree, bricks);
    if (tree.unkept.length >= BATCH) await flush(tree);
  }
}

async function flush(tree: Tree): Promise<void> {
  const bricks = tree.unkept;
  if (bricks.length === 0) return;
  tree.unkept = [];
  await (await cache).keepBricks(tree.volume, bricks);
}

type Volume = Readonly<{ tile: string; channel: string; source: string }>;

/** Requests the volumes that were not requested on this connection. */
async function open(wanted: readonly Volume[]): Promise<void> {
  const fresh = wanted.filter(({ tile, channel }) => !requested.has(`${tile}/${channel}`));
  if (fresh.length === 0 || socket?.readyState !== WebSocket.OPEN) return;
  for (const { tile, channel } of fresh) requested.add(`${tile}/${channel}`);
  const asked = await Promise.all(
    fresh.map(async ({ tile, channel, source }) => {
      const kept = await (await cache).table(`${source}/${channel}`);
      return { tile, channel, ...(kept === null ? {} : { table: kept.hash }) };
    }),
  );
  for (let from = 0; from < asked.length; from += MAX_AT_ONCE) {
    send({ type: "open", volumes: asked.slice(from, from + MAX_AT_ONCE) });
  }
}

/** Requests a volume, or sends again the loaded bricks of one that is open. */
async function openOne(volume: Volume): Promise<void> {
  const isOf = ({ tile, channel }: Tree) => tile === volume.tile && channel === volume.channel;
  const found = [...trees].find(([, tree]) => isOf(tree));
  if (found === undefined) await open([volume]);
  else if (found[1].table !== null) {
    await flush(found[1]);
    await begin(...found);
  }
}

/**
 * Trees of wanted volumes whose table is loaded; the server knows which of their bricks are in the
 * cache.
 */
function readyTrees(): readonly number[] {
  return [...trees]
    .filter(([, { isBegun, tile, channel }]) => isBegun && volumes.has(`${tile}/${channel}`))
    .map(([number]) => number);
}

/** Requests the bricks that the view needs of all open trees. */
function requestView(): void {
  if (view === null) return;
  const ready = readyTrees();
  if (ready.length === 0) return;
  const { clip, eye, gaze, pixels_per_radian, texel_px, budget } = view;
  viewId++;
  send({
    type: "view",
    id: viewId,
    trees: ready.slice(-64),
    clip,
    eye,
    gaze,
    pixels_per_radian,
    texel_px,
    budget,
  });
}

self.addEventListener("message", ({ data }: MessageEvent<LinkRequest>) => {
  if (data.type === "connect") {
    address = data.address;
    connect();
  } else if (data.type === "open") {
    const { tile, channel, source } = data;
    volumes.set(`${tile}/${channel}`, { tile, channel, source });
    turn = turn.then(() => openOne({ tile, channel, source })).catch(fail);
  } else if (data.type === "close") {
    volumes.delete(`${data.tile}/${data.channel}`);
  } else {
    view = data;
    requestView();
  }
});
