import { describe, expect, it } from "vitest";
import { memoryBudget } from "./memory_budget";

const DESKTOP = "Mozilla/5.0 (X11; Linux x86_64) Chrome/140.0";
const MIB = 1024 * 1024;

describe("the memory budget of a device", () => {
  it("is 128 MiB of volumes on a phone, or with little memory", () => {
    const phone = memoryBudget({ userAgent: `${DESKTOP} Mobile (Linux; Android 13)` });
    expect(phone.volumes).toBe(128 * MIB);
    expect(memoryBudget({ userAgent: DESKTOP, deviceMemory: 4 })).toEqual(phone);
  });

  it("is larger on a computer", () => {
    const desktop = memoryBudget({ userAgent: DESKTOP, deviceMemory: 8 });
    expect(desktop.volumes).toBeGreaterThan(128 * MIB);
    expect(memoryBudget({ userAgent: DESKTOP })).toEqual(desktop);
  });
});
