// Difference of depth between pixels, in voxels, that counts as a jump; a smaller one is the slope
// of one surface.
const float JUMP_VOXELS = 4.0;

// Distance along this fragment's ray to a depth, in the ray's own units. View z grows linearly
// along the ray and is vViewZ at distance `back`.
float distanceOf(float depth, float back) {
  float viewZ = -vDepth.y / (2.0 * depth - 1.0 + vDepth.x);
  return back * viewZ / vViewZ;
}

// This fragment's pixel in the whole frame.
ivec2 pixelHere() {
  return ivec2((gl_FragCoord.xy - uPart.xy) * uEye.zw / uPart.zw + uEye.xy);
}

// Distance of the nearest translucent surface.
float paneDistance(float back) {
  return distanceOf(texelFetch(uPaneDepth, pixelHere(), 0).r, back);
}

// Where the opaque scene ends the ray. Component x is at the pixel's centre, y behind a silhouette
// that runs through the pixel, z the share of the pixel that sees past the silhouette. The frame is
// multisampled but its depth is not, so otherwise a pixel at a silhouette would show the background
// between mesh and volume.
vec3 sceneDistances(float back) {
  ivec2 pixel = pixelHere();
  ivec2 first = ivec2(uEye.xy);  // the other eye's depth begins next to this one's
  ivec2 last = ivec2(uEye.xy + uEye.zw) - 1;
  float nearest = texelFetch(uSceneDepth, pixel, 0).r;
  float near = distanceOf(nearest, back);
  if (nearest >= 1.0) return vec3(near, near, 0.0);  // nothing lies behind the far plane
  float far = near;
  float farther = 0.0;
  for (int i = 0; i < 4; i++) {
    ivec2 aside = i < 2 ? ivec2(2 * i - 1, 0) : ivec2(0, 2 * i - 5);
    float depth = texelFetch(uSceneDepth, clamp(pixel + aside, first, last), 0).r;
    float there = distanceOf(depth, back);
    if (there < near + JUMP_VOXELS * uVoxel) continue;
    far = max(far, there);
    farther += 1.0;
  }
  // A slanted edge leaves two of the four neighbours free.
  return vec3(near, far, min(1.0, farther / 2.0));
}
