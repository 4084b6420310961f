// Returns the byte, 0..255, of a row of the table of objects. A line of the texture has 256 rows.
int objectTexel(sampler2D bytes, float row) {
  int i = int(row + 0.5);
  return int(texelFetch(bytes, ivec2(i & 255, i >> 8), 0).r * 255.0 + 0.5);
}
