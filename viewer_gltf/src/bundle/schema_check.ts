/** Checks a bundle's JSON files by the schemas that the pipeline uses to write them. */
import { type OutputUnit, type Schema, Validator } from "@cfworker/json-schema";
import bundleSchema from "../../../schemas/bundle.schema.json";
import transfer2dSchema from "../../../schemas/transfer2d.schema.json";
import volumesSchema from "../../../schemas/volumes.schema.json";
import { BundleError } from "./errors";
import type { Manifest } from "./generated/bundle";
import type { ChannelTransfer2D } from "./generated/transfer2d";
import type { ChannelVolumes } from "./generated/volumes";
import { faultOf, MAX_SHAPES } from "./transfer_2d";

const FORMAT = "stereocell-bundle";
const VERSION = 1;

export function checkSchema(schema: object, value: unknown, path: string): void {
  const result = new Validator(schema as Schema, "2020-12", true).validate(value);
  if (result.valid) return;
  // The innermost error is the most specific. After a wrong tuple the validator adds an error without details, "false".
  const depth = (unit: OutputUnit) => unit.instanceLocation.split("/").length;
  const specific = result.errors.filter((unit) => unit.keyword !== "false");
  const { instanceLocation, error } = (specific.length > 0 ? specific : result.errors).reduce(
    (a, b) => (depth(b) >= depth(a) ? b : a),
  );
  const field = instanceLocation.replace(/^#\/?/, "").replaceAll("/", ".");
  throw new BundleError(`${path}: ${field === "" ? "" : `${field}: `}${error}`);
}

function fieldOf(value: unknown, key: string): unknown {
  if (value === null || typeof value !== "object") return undefined;
  return (value as Record<string, unknown>)[key];
}

/** Checks format, version and schema of a manifest, and returns it. Throws BundleError. */
export function checkManifest(value: unknown): Manifest {
  const format = fieldOf(value, "format");
  if (format !== FORMAT) {
    const found = format === undefined ? "missing" : JSON.stringify(format);
    throw new BundleError(`manifest.json: format is ${found}, expected "${FORMAT}"`);
  }
  const version = fieldOf(value, "version");
  if (version !== VERSION) {
    const found = version === undefined ? "missing" : JSON.stringify(version);
    throw new BundleError(
      `manifest.json: version is ${found}, expected ${VERSION}: open the bundle with the viewer of the ` +
        "program that built it",
    );
  }
  checkSchema(bundleSchema, value, "manifest.json");
  const manifest = value as Manifest;
  if (manifest.channels.length === 0) {
    throw new BundleError(
      "manifest.json: channels is empty, expected at least one channel: build the bundle again",
    );
  }
  return manifest;
}

/** Checks a channel's volumes.json by its schema, and returns it. Throws BundleError. */
export function checkVolumes(value: unknown, path: string): ChannelVolumes {
  checkSchema(volumesSchema, value, path);
  return value as ChannelVolumes;
}

/** Checks a channel's transfer2d.json by its schema, and each of its shapes, and returns it. Throws BundleError. */
export function checkTransfer2d(value: unknown, path: string): ChannelTransfer2D {
  checkSchema(transfer2dSchema, value, path);
  const checked = value as ChannelTransfer2D;
  for (const [name, shapes] of Object.entries(checked.functions)) {
    if (shapes.length > MAX_SHAPES) {
      const found = `found ${shapes.length} shapes, expected at most ${MAX_SHAPES}`;
      throw new BundleError(`${path}: functions.${name}: ${found}`);
    }
    shapes.forEach((shape, i) => {
      const fault = faultOf(shape);
      if (fault !== null) throw new BundleError(`${path}: functions.${name}.${i}: ${fault}`);
    });
  }
  return checked;
}
