import { describe, expect, it } from "vitest";
import { askOrientation } from "./user_gesture";

describe("asking for the orientation", () => {
  it("has three answers", async () => {
    expect(await askOrientation({})).toBe("absent");
    expect(await askOrientation({ DeviceOrientationEvent: {} })).toBe("granted");
    const asking = (requestPermission: () => Promise<string>) =>
      askOrientation({ DeviceOrientationEvent: { requestPermission } });
    expect(await asking(async () => "granted")).toBe("granted");
    expect(await asking(async () => "denied")).toBe("refused");
    const late = () => Promise.reject(new DOMException("not in a tap", "NotAllowedError"));
    expect(await asking(late)).toBe("refused");
  });
});
