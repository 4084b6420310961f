import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { writeKtx2 } from "../../test/support/fixture/ktx2";
import { sampleManifest } from "../../test/support/fixture/manifest";
import { BASE, WorkerStub } from "../../test/support/fixture/unit";
import type { FileRef } from "../bundle/generated/bundle";
import type { Transfer2d } from "../bundle/transfer_2d";
import { makeShape } from "../state/transfer_shapes";
import { TransferFunctions2dLoader } from "./transfer_functions_loader";

const SHAPE = makeShape("triangle", { value: 0.5, gradient: 0.5 });
const HISTOGRAM = writeKtx2([256, 64, 1], 1, [new Uint8Array(256 * 64)]).file;

function refOf(path: string, bytes: Uint8Array | string): FileRef {
  // without a secure context, hashes are not checked
  return { path, bytes: new Blob([bytes as string]).size, sha256: "" };
}

function textOf(functions: object): string {
  const histogram = { ...refOf("histogram2d.ktx2", HISTOGRAM), sha256: "0".repeat(64) };
  return JSON.stringify({ gradient_max: 0.4, functions, histogram, most: 3 });
}

describe("the two-dimensional transfer functions of a bundle", () => {
  const requested: string[] = [];
  const faults: unknown[] = [];
  const learned: Transfer2d[] = [];
  let text = "";

  beforeEach(() => {
    for (const list of [requested, faults, learned]) list.length = 0;
    vi.stubGlobal("Worker", WorkerStub);
    vi.stubGlobal("fetch", async (address: URL | string) => {
      const path = String(address).slice(BASE.length);
      requested.push(path);
      return new Response(path === "histogram2d.ktx2" ? HISTOGRAM : text);
    });
  });
  afterEach(() => vi.unstubAllGlobals());

  function loader(functions: object): TransferFunctions2dLoader {
    text = textOf(functions);
    const manifest = sampleManifest(1);
    manifest.channels[0].transfer_functions_2d.file = refOf("transfer2d.json", text);
    const onFunctions = (_: string, transfer2d: Transfer2d) => learned.push(transfer2d);
    const onError = (error: unknown) => faults.push(error);
    return new TransferFunctions2dLoader(
      { base: BASE, manifest },
      onFunctions,
      () => undefined,
      onError,
    );
  }

  const loaded = (set: TransferFunctions2dLoader) => vi.waitUntil(() => !set.isLoading);

  it("are fetched once, and the histogram only when it is shown", async () => {
    const set = loader({ soft: [SHAPE] });
    for (let i = 0; i < 3; i++) set.want("c0");
    expect(set.isLoading).toBe(true);
    await loaded(set);
    set.want("c0");
    expect(requested).toEqual(["transfer2d.json"]);
    expect(learned).toEqual([{ gradient_max: 0.4, functions: { soft: [SHAPE] } }]);
    for (let i = 0; i < 3; i++) expect(set.histogram("c0")).toBeNull();
    await loaded(set);
    expect(set.histogram("c0")?.cells).toHaveLength(256 * 64);
    expect(requested).toEqual(["transfer2d.json", "histogram2d.ktx2"]);
    expect(JSON.stringify(set.histogram("c0"))).toBe('"histogram2d.ktx2"');
    expect(faults).toEqual([]);
  });

  it("report a fault once, and are fetched again on request", async () => {
    const wrong = [
      [{ ...SHAPE, values: [0.6, 0.4] }, "functions.soft.0: values are (0.6, 0.4)"],
      [{ ...SHAPE, opacity: 2 }, "functions.soft.0.opacity"],
    ] as const;
    for (const [shape, words] of wrong) {
      faults.length = 0;
      const set = loader({ soft: [shape] });
      set.want("c0");
      await loaded(set);
      set.want("c0");
      await loaded(set);
      expect(faults.map(String)).toEqual([expect.stringContaining(`transfer2d.json: ${words}`)]);
      set.retryFailed();
      set.want("c0");
      await loaded(set);
      expect(faults).toHaveLength(2);
    }
    const many = loader({ soft: Array.from({ length: 33 }, () => SHAPE) });
    many.want("c0");
    await loaded(many);
    expect(String(faults.at(-1))).toContain("found 33 shapes, expected at most 32");
    expect(learned).toEqual([]);
  });
});
