import type { WebGLRenderer } from "three";
import { describe, expect, it } from "vitest";
import { XrSession } from "./session";

describe("a stereo session", () => {
  it("can be started again after a start that failed", async () => {
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
    );
    await expect(stereo.start(system)).rejects.toThrow("no layer");
    expect(stereo.isRunning).toBe(false);
    await stereo.start(system);
    expect(stereo.isRunning).toBe(true);
    expect(started).toBe(1);
  });

  it("asks for a frame rate and for foveation only if they are offered", async () => {
    const requests: string[] = [];
    const makeSession = (rates: number[] | undefined) =>
      Object.assign(new EventTarget(), {
        end: async () => undefined,
        supportedFrameRates: rates && new Float32Array(rates),
        updateTargetFrameRate: async (rate: number) => {
          requests.push(`${rate} Hz`);
          throw new DOMException("not now", "InvalidStateError");
        },
      });
    const xr = {
      enabled: false,
      setReferenceSpaceType: () => undefined,
      setSession: async () => undefined,
      setFoveation: (share: number) => requests.push(`foveation ${share}`),
    };
    for (const rates of [[72, 90, 120], [60], undefined]) {
      const stereo = new XrSession(
        { xr } as unknown as WebGLRenderer,
        () => requests.push("started"),
        () => undefined,
      );
      const requestSession = async () => makeSession(rates);
      await stereo.start({ requestSession } as unknown as XRSystem);
    }
    const plain = ["foveation 0.67", "started"];
    expect(requests).toEqual(["foveation 0.67", "72 Hz", "started", ...plain, ...plain]);
  });
});
