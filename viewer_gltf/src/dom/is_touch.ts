/** Whether fingers point on this device, where a mouse does elsewhere. */
export const isTouch = (): boolean => matchMedia("(pointer: coarse)").matches;
