import { describe, expect, it } from "vitest";
import type { OccupancyRequest } from "../voxels/empty_space";
import { OccupancyClient, type OccupancyPort } from "./empty_space_client";

const BRICKS = new Uint8Array(2);

function request(x: number): OccupancyRequest {
  return { bricks: [BRICKS], alphas: [], count: [x, 1, 1] };
}

/** A worker that answers on demand, with the x count of the request. */
function standIn() {
  const asked: number[] = [];
  let isTerminated = false;
  const port: OccupancyPort = {
    onmessage: null,
    onerror: null,
    onmessageerror: null,
    postMessage: (message: OccupancyRequest) => void asked.push(message.count[0]),
    terminate: () => {
      isTerminated = true;
    },
  };
  const client = new OccupancyClient(() => port);
  const self = port as Worker;
  return {
    asked,
    client,
    isTerminated: () => isTerminated,
    answer: () => {
      const data = Uint8Array.of(asked[asked.length - 1]);
      port.onmessage?.call(self, { data } as MessageEvent);
    },
    fail: (message?: string) => {
      port.onerror?.call(self, { message, preventDefault: () => undefined } as ErrorEvent);
    },
  };
}

describe("empty-space tables from the worker", () => {
  it("arrive one after the other", async () => {
    const { asked, answer, client } = standIn();
    const first = client.computeDistances("a", request(1));
    const second = client.computeDistances("b", request(2));
    expect(asked).toEqual([1]);
    answer();
    expect(asked).toEqual([1, 2]);
    answer();
    expect([await first, await second]).toEqual([Uint8Array.of(1), Uint8Array.of(2)]);
  });

  it("are null for a request that a newer one with the same key has replaced", async () => {
    const { asked, answer, client } = standIn();
    const all = [1, 2, 3, 4].map((x) => client.computeDistances("a", request(x)));
    answer(); // answers the first, which is outdated by now
    answer();
    expect(asked).toEqual([1, 4]);
    expect(await Promise.all(all)).toEqual([null, null, null, Uint8Array.of(4)]);
  });

  it("do not keep another key waiting while one changes continuously", async () => {
    const { asked, answer, client } = standIn();
    void client.computeDistances("a", request(1));
    void client.computeDistances("a", request(2));
    const other = client.computeDistances("b", request(10));
    void client.computeDistances("a", request(3));
    answer();
    answer();
    expect(asked).toEqual([1, 10, 3]);
    expect(await other).toEqual(Uint8Array.of(10));
  });

  it("fail for the current request alone if the worker throws; the next request is answered", async () => {
    const { answer, client, fail } = standIn();
    const bad = client.computeDistances("a", request(1));
    const good = client.computeDistances("b", request(2));
    fail("RangeError: expected 8 bytes");
    answer();
    await expect(bad).rejects.toThrow("expected 8 bytes");
    expect(await good).toEqual(Uint8Array.of(2));
  });

  it("all fail if the worker's script did not load", async () => {
    const { client, fail } = standIn();
    const all = ["a", "b"].map((key) => client.computeDistances(key, request(1)));
    fail();
    for (const promise of all) await expect(promise).rejects.toThrow("did not load");
    await expect(client.computeDistances("c", request(1))).rejects.toThrow("did not load");
  });

  it("are null after the client is disposed", async () => {
    const { client, isTerminated } = standIn();
    const all = ["a", "b"].map((key) => client.computeDistances(key, request(1)));
    client.dispose();
    all.push(client.computeDistances("c", request(1)));
    expect(await Promise.all(all)).toEqual([null, null, null]);
    expect(isTerminated()).toBe(true);
  });
});
