import type { WebGLRenderer } from "three";
import { describe, expect, it } from "vitest";
import { XrSession } from "./session";

describe("a stereo session", () => {
  it("can be started again after it could not be set up", async () => {
    let tries = 0;
    const xr = {
      enabled: false,
      setReferenceSpaceType: () => undefined,
      setSession: async () => {
        tries++;
        if (tries === 1) throw new DOMException("no layer", "InvalidStateError");
      },
    };
    const session = Object.assign(new EventTarget(), { end: async () => undefined });
    const system = { requestSession: async () => session } as unknown as XRSystem;
    let started = 0;
    const stereo = new XrSession(
      { xr } as unknown as WebGLRenderer,
      () => started++,
      () => undefined,
      () => undefined,
    );
    await expect(stereo.start(system)).rejects.toThrow("no layer");
    expect(stereo.isRunning).toBe(false);
    await stereo.start(system);
    expect(stereo.isRunning).toBe(true);
    expect(started).toBe(1);
  });
});
