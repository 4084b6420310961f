import { describe, expect, it } from "vitest";
import type { Part, PartDefinition } from "./part";
import { inOrder, Parts } from "./parts";

const definition = (id: string, rank?: number): PartDefinition => ({
  id,
  ...(rank !== undefined && { rank }),
  create: () => ({ id, dispose: () => undefined }),
});

function partsOf(...all: readonly Partial<Part>[]): Parts {
  const parts = new Parts([]);
  for (const each of all) parts.add({ id: "part", dispose: () => undefined, ...each });
  return parts;
}

describe("the parts of a viewer", () => {
  it("are made by rank; those without a rank follow in the order of the list", () => {
    const listed = [
      definition("b"),
      definition("last", 30),
      definition("a"),
      definition("one", 10),
    ];
    expect(inOrder(listed).map(({ id }) => id)).toEqual(["one", "last", "b", "a"]);
  });

  it("are all notified of the opening, which ends with the slowest part", async () => {
    const heard: string[] = [];
    const slow = async () => {
      await new Promise((resolve) => setTimeout(resolve, 5));
      heard.push("slow");
    };
    const parts = partsOf({ afterOpening: slow }, {}, { afterOpening: () => heard.push("quick") });
    await parts.afterOpening();
    expect(heard).toEqual(["quick", "slow"]);
  });

  it("return a service by its name, or null if no part offers it", () => {
    const links = { load: () => Promise.reject(new Error("none")), writeAddress: () => undefined };
    const parts = partsOf({}, { services: { links } });
    expect(parts.service("links")).toBe(links);
    expect(parts.service("volumes")).toBeNull();
  });

  it("list their forms", () => {
    const forms = [{ triangles: 3 }, { triangles: 4 }];
    const parts = partsOf({ form: forms[0] }, {}, { form: forms[1] });
    expect(parts.forms).toEqual(forms);
  });
});
