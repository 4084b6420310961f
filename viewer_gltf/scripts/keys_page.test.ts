import { readFile } from "node:fs/promises";
import { fileURLToPath } from "node:url";
import { expect, it } from "vitest";
import { pageOfKeys } from "./keys_page";

const PAGE = fileURLToPath(new URL("../../docs/keys.md", import.meta.url));

it("docs/keys.md lists the keys of this version; `npm run keys-page` writes it", async () => {
  await expect(pageOfKeys(await readFile(PAGE, "utf8"))).toMatchFileSnapshot(PAGE);
});
