import { afterEach, describe, expect, it, vi } from "vitest";
import { TemporaryError } from "./errors";
import { readBody, request } from "./fetch";

const text = (response: Response) => response.text();

/** Returns a response whose body breaks after its first byte. */
function broken(): Response {
  const body = new ReadableStream({
    pull(controller) {
      controller.enqueue(new Uint8Array([65]));
      controller.error(new TypeError("network error"));
    },
  });
  return new Response(body, { status: 206, headers: { "Content-Range": "bytes 0-1/9" } });
}

const whole = () =>
  new Response("AB", { status: 206, headers: { "Content-Range": "bytes 0-1/9" } });

describe("a request", () => {
  afterEach(() => vi.unstubAllGlobals());

  it("is tried again when its connection breaks within the file", async () => {
    const answers = [broken(), whole()];
    const fetched = vi.fn(async () => answers.shift());
    vi.stubGlobal("fetch", fetched);
    const response = await request("https://host/a", "a");
    expect(response.status).toBe(206);
    expect(response.headers.get("Content-Range")).toBe("bytes 0-1/9");
    expect(await text(response)).toBe("AB");
    expect(fetched).toHaveBeenCalledTimes(2);
  });

  it("is not tried again after it was aborted", async () => {
    const stop = new AbortController();
    const fetched = vi.fn(async () => {
      stop.abort();
      throw new DOMException("stopped", "AbortError");
    });
    vi.stubGlobal("fetch", fetched);
    await expect(request("https://host/a", "a", { signal: stop.signal })).rejects.toThrow(
      "stopped",
    );
    expect(fetched).toHaveBeenCalledTimes(1);
  });

  it.each([
    ["", "can't be reached, or forbids this page"],
    [503, "answers with status 503"],
  ])("that fails because of the host (%s) is reported once for all", async (status, fault) => {
    vi.useFakeTimers();
    vi.stubGlobal("fetch", async () => {
      if (status === "") throw new TypeError("no network");
      return new Response("", { status: Number(status) });
    });
    const failed = Promise.allSettled(
      ["a", "b"].map((path) => request(`https://host/${path}`, path)),
    );
    await vi.runAllTimersAsync();
    vi.useRealTimers();
    for (const each of await failed) {
      const { reason } = each as PromiseRejectedResult;
      expect(reason).toBeInstanceOf(TemporaryError);
      expect(reason.notice).toBe(`The host host ${fault}: some files are missing.`);
    }
  });

  it("fails at once if the file does not exist", async () => {
    const fetched = vi.fn(async () => new Response("", { status: 404 }));
    vi.stubGlobal("fetch", fetched);
    await expect(request("https://host/a", "a")).rejects.toThrow("a: not found (404)");
    expect(fetched).toHaveBeenCalledTimes(1);
  });
});

it("reports a body that breaks as a temporary fault", async () => {
  await expect(readBody(broken(), "a")).rejects.toThrow(TemporaryError);
  await expect(readBody(broken(), "a")).rejects.toThrow(
    "a: the connection broke before the file's end",
  );
});
