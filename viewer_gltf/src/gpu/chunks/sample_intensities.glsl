#ifdef STREAM_BRICK
// Virtual texturing: the texture uVolume is an atlas of bricks of STREAM_BRICK^3 texels, each with
// an apron of one texel. The texture uIndex has an entry for each cell of STREAM_BRICK^3 texels,
// channel by channel. The entry is the slot (x, y, z) and level (a) of the cell's brick. If a is
// 255, the whole cell has the value r / 255.
vec4 sampleIntensities(vec3 p) {
  const float EDGE = float(STREAM_BRICK);
  ivec3 size = textureSize(uIndex, 0);
  ivec3 cells = ivec3(size.xy, size.z / CHANNELS);
  vec3 texel = clamp(p, 0.0, 1.0) * uTexels;
  ivec3 cell = min(ivec3(texel / EDGE), cells - 1);
  vec3 atlas = vec3(textureSize(uVolume, 0));
  vec4 v = vec4(0.0);
  for (int c = 0; c < CHANNELS; c++) {
    uvec4 entry = texelFetch(uIndex, cell + ivec3(0, 0, c * cells.z), 0);
    if (entry.a == 255u) {
      v[c] = float(entry.r) / 255.0;
      continue;
    }
    int level = int(entry.a);
    vec3 inside = texel / float(1 << level) - EDGE * vec3(cell >> level) + 1.0;
    v[c] = texture(uVolume, ((EDGE + 2.0) * vec3(entry.rgb) + clamp(inside, 1.0, EDGE + 1.0)) / atlas).r;
  }
  return v;
}
#else
// Intensity of each channel, 0 to 1, at a texture coordinate. A software renderer reads both textures
// on both sides of a branch, so the old one is left out while nothing fades in.
vec4 sampleIntensities(vec3 p) {
#ifdef FADES
  return mix(textureLod(uOldVolume, p, 0.0), textureLod(uVolume, p, 0.0), uFresh);
#else
  return textureLod(uVolume, p, 0.0);
#endif
}
#endif
