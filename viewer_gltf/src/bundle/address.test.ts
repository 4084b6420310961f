import { describe, expect, it } from "vitest";
import { bundleAddress, namesBundle, sourceAddress } from "./address";

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

describe("the source's address", () => {
  it("is relative or absolute, with a query that the host needs", () => {
    expect(sourceAddress("https://host/a/?source=../x.zarr")).toBe("https://host/x.zarr");
    expect(sourceAddress("https://host/?source=https%3A%2F%2Fb%2Fx.ozx%3Ft%3D1%23y")).toBe(
      "https://b/x.ozx?t=1",
    );
  });

  it("is null if the page shows a bundle", () => {
    for (const page of ["https://host/", "https://host/?source=", "https://host/?bundle=x/"]) {
      expect(sourceAddress(page)).toBeNull();
    }
    expect([namesBundle("https://host/?bundle=x/"), namesBundle("https://host/")]).toEqual([
      true,
      false,
    ]);
  });

  it("is an address of the web, and can't be combined with a bundle", () => {
    for (const wrong of ["file:///etc/passwd", "http://", "javascript:alert(1)", "data:,x"]) {
      const page = `https://host/?source=${encodeURIComponent(wrong)}`;
      expect(() => sourceAddress(page)).toThrow("expected an image's address on the web");
    }
    expect(() => sourceAddress("https://host/?source=x.zarr&bundle=y/")).toThrow("are both given");
  });
});
