/** Budget of GPU memory and triangles for a device. */

export type Device = Readonly<{ userAgent: string; deviceMemory?: number }>;

/**
 * Bytes for all volumes together and for all surfaces together; largest number of triangles in
 * view.
 */
export type MemoryBudget = Readonly<{ volumes: number; surfaces: number; triangles: number }>;

const MIB = 1024 * 1024;
const SMALL: MemoryBudget = { volumes: 128 * MIB, surfaces: 128 * MIB, triangles: 1_500_000 };
const LARGE: MemoryBudget = { volumes: 512 * MIB, surfaces: 384 * MIB, triangles: 8_000_000 };
/**
 * GiB as reported by browsers. A computer with at most this much memory is treated like a phone.
 */
const LITTLE = 4;

export function memoryBudget({ userAgent, deviceMemory }: Device): MemoryBudget {
  const isPhone = /Android|iPhone|iPad|Mobile/.test(userAgent);
  return isPhone || (deviceMemory ?? 2 * LITTLE) <= LITTLE ? SMALL : LARGE;
}
