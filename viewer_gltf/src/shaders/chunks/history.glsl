// What earlier frames have gathered for a pixel. Seen from a little aside, it is looked up where
// this pixel's surface was before, if it is the same surface there; so much of it is kept that the
// picture can follow.
struct History {
  vec4 sums;
  vec4 moments;
};

// Whether a tile takes a sample in this frame. Frames that draw a part of the tiles take turns; of
// its turns a noisy tile takes each, a calm one some, so that what it missed still comes to light.
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
  vec4 sums = texelFetch(uSums, pixel, 0);
  vec4 moments = texelFetch(uMoments, pixel, 0);
  if (uHistory == 1) return History(sums, moments);
  vec2 device = 2.0 * at / uPart.zw - 1.0;
  vec4 far = uToBox * vec4(device, 1.0, 1.0);
  vec3 dir = normalize(far.xyz / far.w - uEyeAt);
  bool isMet = sums.a > 0.0;
  float away = isMet ? moments.z / sums.a : 1e3 * length(uSize);  // what is empty is far away
  vec3 point = uEyeAt + away * dir;
  vec4 there = uToBefore * vec4(point, 1.0);
  vec2 was = (0.5 * there.xy / there.w + 0.5) * uPart.zw - 0.5;
  if (there.w <= 0.0) return none;
  vec2 corner = floor(was);
  vec2 share = was - corner;
  float expected = distance(point, uEyeBefore);
  History sum = none;
  float total = 0.0;
  for (int k = 0; k < 4; k++) {
    vec2 side = vec2(k & 1, k >> 1);
    vec2 tap = corner + side;
    if (any(lessThan(tap, vec2(0.0))) || any(greaterThanEqual(tap, uPart.zw))) continue;
    ivec2 source = ivec2(tap + uPart.xy);
    vec4 s = texelFetch(uSums, source, 0);
    vec4 m = texelFetch(uMoments, source, 0);
    bool isMetThere = s.a > 0.0;
    if (isMet != isMetThere) continue;
    if (isMet && abs(m.z / s.a - expected) > 0.02 * length(uSize)) continue;
    vec2 near = mix(1.0 - share, share, side);
    float weight = near.x * near.y;
    sum.sums += weight * s;
    sum.moments += weight * m;
    total += weight;
  }
  if (total < 0.05) return none;
  float count = max(sum.moments.y / total, 1e-6);
  float keep = min(1.0, uMostHistory / count) / total;
  return History(keep * sum.sums, keep * sum.moments);
}
