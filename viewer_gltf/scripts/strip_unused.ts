/** Leaves parts of libraries out of the page that none of the bundle's files can need. */
import type { Plugin } from "vite";

/** The extensions that surfaces of a bundle have and three's loader reads by a class of its own. */
const KEPT = /GLTFTextureBasisUExtension|EXT_MESHOPT_COMPRESSION/;
const REGISTERED = /this\.register\( function \( parser \) \{\s*return new (.*) \);\s*\} \);/g;

/** Return three's glTF loader without the extensions that no surface of a bundle has. */
export function withoutExtensions(code: string): string {
  return code.replace(REGISTERED, (text, made: string) => (KEPT.test(made) ? text : ""));
}

/** Whether a schema asks that a text be a date, an address or the like. */
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
