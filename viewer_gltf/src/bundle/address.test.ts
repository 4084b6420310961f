import { describe, expect, it } from "vitest";
import { bundleAddress } from "./address";

describe("the bundle's address", () => {
  it("is beside the page by default", () => {
    expect(bundleAddress("https://host/a/b/index.html")).toBe("https://host/a/b/");
    expect(bundleAddress("https://host/a/b/?x=1#y")).toBe("https://host/a/b/");
  });

  it("is a folder or its manifest, relative or absolute", () => {
    expect(bundleAddress("https://host/a/?bundle=../demo")).toBe("https://host/demo/");
    expect(bundleAddress("https://host/a/?bundle=demo/manifest.json")).toBe("https://host/a/demo/");
    expect(bundleAddress("https://host/?bundle=https://other/x/")).toBe("https://other/x/");
  });

  it("is an address of the web", () => {
    for (const wrong of ["http://", "https://a b/", "ftp://host/x/", "mailto:x"]) {
      const page = `https://host/?bundle=${encodeURIComponent(wrong)}`;
      expect(() => bundleAddress(page)).toThrow(`expected a folder's address on the web`);
    }
  });

  it("keeps a query that the host needs", () => {
    expect(bundleAddress("https://host/?bundle=%2Fdemo%3Ftoken%3D1")).toBe(
      "https://host/demo/?token=1",
    );
  });
});
