// A byte of a table with a row an object, 0..255: 256 rows of it are a line of the texture.
int objectTexel(sampler2D bytes, float row) {
  int i = int(row + 0.5);
  return int(texelFetch(bytes, ivec2(i & 255, i >> 8), 0).r * 255.0 + 0.5);
}
