// The history of a pixel: samples gathered in earlier frames. After a small move of the eye it is
// looked up where this pixel's surface was before, except where nearer or farther things were. Only
// a limited number of samples is kept, so that the image follows changes.
float hitDistanceAt(ivec2 pixel) {
  float covered = texelFetch(uSums, pixel, 0).a;
  return covered > 0.0 ? texelFetch(uMoments, pixel, 0).z / covered : 0.0;
}

struct History {
  vec4 sums;
  vec4 moments;
};

// Whether the pixels of a tile of the frame take a sample in this pass. Passes that draw only some
// tiles take turns. A noisy tile uses each of its turns, a calm one only some, so that details that
// it missed still appear.
bool isDrawn(ivec2 tile) {
  seedRandom(uvec3(tile, 0u));
  float turn = fract(random() - uTurn.x);
  if (turn >= uTurn.y) return false;
  if (uCalm <= 0.0) return true;
  seedRandom(uvec3(tile, uSample));
  float noisiness = texelFetch(uNoisiness, tile, 0).r;
  return random() < clamp(noisiness / uCalm, 0.125, 1.0);
}

History historyAt(ivec2 pixel, vec2 at) {
  History none = History(vec4(0.0), vec4(0.0));
  if (uHistory == 0) return none;
  if (uHistory == 1) return History(texelFetch(uSums, pixel, 0), texelFetch(uMoments, pixel, 0));
  vec4 far = uToBox * vec4(2.0 * at / uPart.zw - 1.0, 1.0, 1.0);
  vec3 dir = normalize(far.xyz / far.w - uEyeAt);
  float away = distance(uEyeAt, 0.5 * uSize);
  bool isHit;
  vec2 was = seek(uEyeAt, dir, uToBefore, uEyeBefore, uPart, away, isHit) - 0.5;
  vec2 corner = floor(was);
  vec2 share = was - corner;
  float expected = distance(uEyeAt + away * dir, uEyeBefore);
  History sum = none;
  float total = 0.0;
  for (int k = 0; k < 4; k++) {
    vec2 side = vec2(k & 1, k >> 1);
    vec2 tap = corner + side;
    if (any(lessThan(tap, vec2(0.0))) || any(greaterThanEqual(tap, uPart.zw))) continue;
    ivec2 source = ivec2(tap + uPart.xy);
    float hit = hitDistanceAt(source);
    if (isHit && hit > 0.0 && abs(hit - expected) > 0.02 * length(uSize)) continue;
    vec2 near = mix(1.0 - share, share, side);
    float weight = near.x * near.y;
    sum.sums += weight * texelFetch(uSums, source, 0);
    sum.moments += weight * texelFetch(uMoments, source, 0);
    total += weight;
  }
  if (total < 0.05) return none;
  float count = max(sum.moments.y / total, 1e-6);
  float keep = min(1.0, uMostHistory / count) / total;
  return History(keep * sum.sums, keep * sum.moments);
}
