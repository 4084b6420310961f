import { afterEach, describe, expect, it, vi } from "vitest";
import { ValuesHost, valuesAddress } from "./values_host";

afterEach(() => vi.unstubAllGlobals());

describe("the address of the measured values", () => {
  const of = (value: string | null) =>
    valuesAddress(
      new Headers(value === null ? {} : { "Stereocell-Values": value }),
      "https://10.0.0.7:8000/x/",
    );

  it("belongs to the host that has them", () => {
    expect(of("version=1")).toBe("https://10.0.0.7:8000/x/values/");
  });

  it("is null if the host has none, or a newer version", () => {
    expect(of(null)).toBeNull();
    expect(of("version=2")).toBeNull();
  });
});

describe("the values of a host", () => {
  const answering = (body: string, status = 200) => {
    const asked = vi.fn(async (_url: string) => new Response(body, { status }));
    vi.stubGlobal("fetch", asked);
    return { asked, host: new ValuesHost("http://localhost:8000/values/") };
  };

  it("are requested once, and known after that", async () => {
    const { asked, host } = answering('{"value": -1023.5}');
    expect(host.known("r0_c0", "CT", [1, -2.5, 0.25])).toBeNull();
    expect(await host.ask("r0_c0", "CT", [1, -2.5, 0.25])).toBe(-1023.5);
    expect(await host.ask("r0_c0", "CT", [1, -2.5, 0.25])).toBe(-1023.5);
    expect(host.known("r0_c0", "CT", [1, -2.5, 0.25])).toBe(-1023.5);
    expect(asked.mock.calls.map(([url]) => url)).toEqual([
      "http://localhost:8000/values/r0_c0/CT?at=1,-2.5,0.25",
    ]);
    expect(host.known("r0_c0", "MR", [1, -2.5, 0.25])).toBeNull();
  });

  it("are null if the host has none at that place", async () => {
    for (const body of ['{"value": null}', "{}", "null", '{"value": "7"}']) {
      const { host } = answering(body);
      expect(await host.ask("r0_c0", "CT", [1, 2, 3])).toBeNull();
      expect(host.known("r0_c0", "CT", [1, 2, 3])).toBeNull();
    }
  });

  it("are requested again after a fault", async () => {
    const { asked, host } = answering("not found", 404);
    await expect(host.ask("r0_c0", "CT", [1, 2, 3])).rejects.toThrow("not found (404)");
    await expect(host.ask("r0_c0", "CT", [1, 2, 3])).rejects.toThrow("not found (404)");
    expect(asked).toHaveBeenCalledTimes(2);
  });

  it("are dropped if there are too many, the oldest first", async () => {
    const { asked, host } = answering('{"value": 7}');
    for (let x = 0; x <= 4096; x++) await host.ask("r0_c0", "CT", [x, 0, 0]);
    expect(host.known("r0_c0", "CT", [0, 0, 0])).toBeNull();
    expect(host.known("r0_c0", "CT", [1, 0, 0])).toBe(7);
    expect(asked).toHaveBeenCalledTimes(4097);
  });
});
