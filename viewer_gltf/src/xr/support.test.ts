import { describe, expect, it } from "vitest";
import { findXrSupport, wayToStereo } from "./support";

const system = (answer: () => Promise<boolean>) => ({ isSessionSupported: answer });

describe("stereo", () => {
  it("is available with a headset", async () => {
    const found = await findXrSupport(
      system(async () => true),
      true,
    );
    expect(found).toEqual({ isAvailable: true, reason: "" });
  });

  it("reports why it is not available", async () => {
    const reasonOf = async (...args: Parameters<typeof findXrSupport>) =>
      (await findXrSupport(...args)).reason;
    expect(await reasonOf(undefined, false)).toContain("https");
    expect(await reasonOf(undefined, true)).toContain("no WebXR");
    expect(
      await reasonOf(
        system(async () => false),
        true,
      ),
    ).toContain("No headset");
    const refuse = () => Promise.reject(new DOMException("policy", "SecurityError"));
    expect(await reasonOf(system(refuse), true)).toContain("refuses WebXR here: policy");
  });
});

describe("the stereo button on the canvas", () => {
  it("leads to a headset, to the split screen on a phone without one, or nowhere", () => {
    const had = { isAvailable: true, reason: "" };
    const none = { isAvailable: false, reason: "none" };
    expect([wayToStereo(had, true), wayToStereo(had, false)]).toEqual(["stereo", "stereo"]);
    expect([wayToStereo(none, true), wayToStereo(none, false)]).toEqual(["split", null]);
  });
});
