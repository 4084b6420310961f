/** Removes parts of libraries from the page that no file of a bundle needs. */
import type { Plugin } from "vite";

/** Extensions of a bundle's surfaces for which three's loader has its own class. */
const KEPT = /GLTFTextureBasisUExtension|EXT_MESHOPT_COMPRESSION/;
const REGISTERED = /this\.register\( function \( parser \) \{\s*return new (.*) \);\s*\} \);/g;

/** Returns the code of three's glTF loader without the extensions that no surface of a bundle has. */
export function withoutExtensions(code: string): string {
  return code.replace(REGISTERED, (text, made: string) => (KEPT.test(made) ? text : ""));
}

/** Returns whether a schema requires a text to be a date, an address or another format. */
export function asksForFormat(schema: string): boolean {
  return /"format":\s*"/.test(schema);
}

export function stripUnused(): Plugin {
  return {
    name: "strip-unused",
    apply: "build",
    enforce: "pre",
    transform(code, id) {
      if (id.endsWith("/three/examples/jsm/loaders/GLTFLoader.js")) {
        const bare = withoutExtensions(code);
        if (bare.length > code.length - 1000) this.error("found none of the loader's extensions");
        return { code: bare, map: null };
      }
      if (id.endsWith("/@cfworker/json-schema/dist/esm/format.js")) {
        return { code: "export const format = {};", map: null };
      }
      if (id.endsWith(".schema.json") && asksForFormat(code)) {
        this.error(`${id}: asks for a format, which strip_unused.ts leaves out of the checks`);
      }
      return null;
    },
  };
}
