// Centre of the box of a row's object, in um, and in w the box's shortest edge. A line of the texture has 256 rows.
vec4 objectMiddle(sampler2D middles, float row) {
  int i = int(row + 0.5);
  return texelFetch(middles, ivec2(i & 255, i >> 8), 0);
}

// Moves a position in a mesh towards the centre of its object's box: see objects/gap.ts.
// `meshToScene` scales uniformly, so the inverse of its 3x3 part is its transpose divided by the squared scale.
vec3 objectDrawnIn(vec3 place, mat4 meshToScene, mat4 umToScene, vec4 middle, float gap) {
  if (gap <= 0.0) return place;
  float gone = min(gap / middle.w, 0.8);
  vec3 way = (umToScene * vec4(middle.xyz, 1.0) - meshToScene * vec4(place, 1.0)).xyz;
  mat3 turned = mat3(meshToScene);
  return place + gone * (way * turned) / dot(turned[0], turned[0]);
}
