import { describe, expect, it } from "vitest";
import { bricksAddress } from "./brick_host";

describe("the address of the bricks", () => {
  const of = (value: string | null, base: string) =>
    bricksAddress(new Headers(value === null ? {} : { "Stereocell-Bricks": value }), base);

  it("belongs to the host of the page, and is encrypted if the page is", () => {
    expect(of("version=1", "http://localhost:8000/")).toBe("ws://localhost:8000/bricks");
    expect(of("version=1", "https://10.0.0.7:8000/x/")).toBe("wss://10.0.0.7:8000/x/bricks");
  });

  it("belongs to the view of a source if that view has its own bricks", () => {
    const folder = "version=1; folder=g12/";
    expect(of(folder, "http://localhost:8000/")).toBe("ws://localhost:8000/g12/bricks");
    expect(of(folder, "http://localhost:8000/g12/")).toBe("ws://localhost:8000/g12/bricks");
    for (const folder of ["", "../", "g1", "//elsewhere/", "g1/../"]) {
      expect(of(`version=1; folder=${folder}`, "http://localhost/"), folder).toBeNull();
    }
  });

  it("is null if the host has no bricks, or newer ones", () => {
    expect(of(null, "http://localhost/")).toBeNull();
    expect(of("version=2", "http://localhost/")).toBeNull();
  });
});
