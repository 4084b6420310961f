/**
 * Red-cyan anaglyphs by Dubois's projection. From the colours that the glasses can show, each pixel
 * takes the pair that looks most like the colours for the two eyes. Greys stay grey, and each eye
 * sees as little as possible of the other eye's image.
 *
 * References
 * ----------
 * Dubois (2001). A projection method to generate anaglyph stereo images. ICASSP, vol. 3, 1661-1664.
 * doi:10.1109/ICASSP.2001.941256. The matrices are the author's for red-cyan glasses and sRGB screens.
 */

/** Matrix, row by row, from a linear colour of one eye to that eye's share of the anaglyph. */
export type Projection = readonly (readonly [number, number, number])[];

export const LEFT: Projection = [
  [0.4561, 0.500484, 0.176381],
  [-0.0400822, -0.0378246, -0.0157589],
  [-0.0152161, -0.0205971, -0.00546856],
];
export const RIGHT: Projection = [
  [-0.0434706, -0.0879388, -0.00155529],
  [0.378476, 0.73364, -0.0184503],
  [-0.0721527, -0.112961, 1.2264],
];
