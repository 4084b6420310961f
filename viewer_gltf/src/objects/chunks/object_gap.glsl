// The middle of the box of a row's object, um, and in w its narrowest side: 256 rows are a line of the texture.
vec4 objectMiddle(sampler2D middles, float row) {
  int i = int(row + 0.5);
  return texelFetch(middles, ivec2(i & 255, i >> 8), 0);
}

// A mesh's place, drawn in towards the middle of its object as objects/gap.ts says. `meshToRoom` turns and moves,
// and scales the same every way: its transpose goes back.
vec3 objectDrawnIn(vec3 place, mat4 meshToRoom, mat4 umToRoom, vec4 middle, float gap) {
  if (gap <= 0.0) return place;
  float gone = min(gap / middle.w, 0.8);
  vec3 way = (umToRoom * vec4(middle.xyz, 1.0) - meshToRoom * vec4(place, 1.0)).xyz;
  mat3 turned = mat3(meshToRoom);
  return place + gone * (way * turned) / dot(turned[0], turned[0]);
}
