/** Fetches measured values of voxels from a host that has the stage in addition to the bundle. */
import type { Vec3 } from "../math/vec3";
import { fileAddress, parseJson, readBody, request } from "./fetch";

/** Header by which the server reports, on every response, that it has measured values. */
const HEADER = "Stereocell-Values";
/** Largest number of values that are kept. */
const MAX_KEPT = 4096;

/** Returns the address below which values are; null if the host has none. */
export function valuesAddress(headers: Headers, base: string): string | null {
  return headers.get(HEADER)?.trim() === "version=1" ? new URL("values/", base).href : null;
}

export class ValuesHost {
  private readonly answers = new Map<string, Promise<number | null>>();
  private readonly values = new Map<string, number>();

  /** @param address as `valuesAddress` returns it */
  constructor(private readonly address: string) {}

  /** Returns the value of a voxel, given by its centre in the volume's own um; null if it was not fetched. */
  known(tile: string, channel: string, voxel_um: Vec3): number | null {
    return this.values.get(keyOf(tile, channel, voxel_um)) ?? null;
  }

  /** Fetches the value of a voxel if it is not known yet; null if the host has none. Throws BundleError. */
  ask(tile: string, channel: string, voxel_um: Vec3): Promise<number | null> {
    const key = keyOf(tile, channel, voxel_um);
    const before = this.answers.get(key);
    if (before !== undefined) return before;
    const [oldest] = this.answers.size < MAX_KEPT ? [] : this.answers.keys();
    if (oldest !== undefined) {
      this.answers.delete(oldest);
      this.values.delete(oldest);
    }
    const answer = this.fetch(key).then((value) => {
      if (value !== null && this.answers.has(key)) this.values.set(key, value);
      return value;
    });
    this.answers.set(key, answer);
    answer.catch(() => this.answers.delete(key));
    return answer;
  }

  private async fetch(key: string): Promise<number | null> {
    const response = await request(fileAddress(this.address, key), key, { cache: "no-store" });
    const answer = parseJson(new TextDecoder().decode(await readBody(response, key)), key);
    const value = (answer as { value?: unknown } | null)?.value;
    return typeof value === "number" && Number.isFinite(value) ? value : null;
  }
}

function keyOf(tile: string, channel: string, voxel_um: Vec3): string {
  return `${tile}/${channel}?at=${voxel_um.join()}`;
}
