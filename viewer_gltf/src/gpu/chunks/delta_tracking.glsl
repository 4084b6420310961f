// Free flight through the medium. No extinction in a brick exceeds its majorant, so that tracking
// brick by brick is unbiased whatever the bricks' size: Woodcock et al. 1965; local majorants:
// Szirmay-Kalos et al., Computer Graphics Forum 2010. `from` and `to` are lengths along the ray, um;
// `dir` is a unit vector, none of its parts 0. Bricks are gone through as by Amanatides & Woo 1987.
const int MAX_EVENTS = 8192;  // no path ends here; it keeps a fault from hanging the page

struct Bricks {
  vec3 pace;  // bricks per um
  ivec3 cell;
  ivec3 way;
  vec3 wall;  // lengths along the ray to the next wall across each axis
  vec3 gap;  // ... and from there to the one after it
};

Bricks enterBricks(vec3 origin, vec3 dir, float from) {
  Bricks b;
  b.pace = uTexPerUm * uTexels / uBrick;
  vec3 start = uTexLow * uTexels / uBrick + origin * b.pace;
  vec3 slope = dir * b.pace;
  ivec3 last = textureSize(uMajorants, 0) - 1;
  b.cell = clamp(ivec3(floor(start + from * slope)), ivec3(0), last);
  b.way = ivec3(sign(slope));
  b.gap = abs(1.0 / slope);
  b.wall = (vec3(b.cell) + max(vec3(b.way), 0.0) - start) / slope;
  return b;
}

void leaveBrick(inout Bricks b) {
  if (b.wall.x <= b.wall.y && b.wall.x <= b.wall.z) {
    b.cell.x += b.way.x;
    b.wall.x += b.gap.x;
  } else if (b.wall.y <= b.wall.z) {
    b.cell.y += b.way.y;
    b.wall.y += b.gap.y;
  } else {
    b.cell.z += b.way.z;
    b.wall.z += b.gap.z;
  }
}

float brickEnd(Bricks b, float to) {
  return min(min(b.wall.x, b.wall.y), min(b.wall.z, to));
}

float majorantOf(Bricks b) {
  ivec3 last = textureSize(uMajorants, 0) - 1;
  return texelFetch(uMajorants, clamp(b.cell, ivec3(0), last), 0).r;
}

// With a number of steps of the reader's own (uStride), the medium is looked up once in each step instead, at
// random: few steps are quick and pass over what is thin, many come to the same.
float trackBySteps(vec3 origin, vec3 dir, float from, float to, out vec4 medium) {
  medium = vec4(0.0);
  for (float t = from; t < to; t += uStride) {
    float stride = min(uStride, to - t);
    float at = t + random() * stride;
    medium = mediumAt(origin + at * dir);
    if (random() >= exp(-medium.a * stride)) return at;
  }
  return -1.0;
}

float transmittanceBySteps(vec3 origin, vec3 dir, float from, float to) {
  float depth = 0.0;
  for (float t = from; t < to; t += uStride) {
    float stride = min(uStride, to - t);
    depth += stride * mediumAt(origin + (t + random() * stride) * dir).a;
  }
  return exp(-depth);
}

// Where the path meets the medium, and what is there; -1: it leaves.
float track(vec3 origin, vec3 dir, float from, float to, out vec4 medium) {
  if (uStride > 0.0) return trackBySteps(origin, dir, from, to, medium);
  Bricks b = enterBricks(origin, dir, from);
  float t = from;
  float depth = -log(1.0 - random());  // optical depth of the majorants to the next event
  for (int i = 0; i < MAX_EVENTS; i++) {
    float end = brickEnd(b, to);
    float majorant = majorantOf(b);
    float inBrick = majorant * max(end - t, 0.0);
    if (inBrick <= depth) {
      depth -= inBrick;
      if (end >= to) return -1.0;
      t = max(t, end);
      leaveBrick(b);
      continue;
    }
    t += depth / majorant;
    medium = mediumAt(origin + t * dir);
    if (random() * majorant < medium.a) return t;
    depth = -log(1.0 - random());
  }
  return -1.0;
}

// Share of light that comes through, by ratio tracking (Novak et al. 2014): right in the mean.
float transmittance(vec3 origin, vec3 dir, float from, float to) {
  if (uStride > 0.0) return transmittanceBySteps(origin, dir, from, to);
  Bricks b = enterBricks(origin, dir, from);
  float t = from;
  float share = 1.0;
  float depth = -log(1.0 - random());
  for (int i = 0; i < MAX_EVENTS; i++) {
    float end = brickEnd(b, to);
    float majorant = majorantOf(b);
    float inBrick = majorant * max(end - t, 0.0);
    if (inBrick <= depth) {
      depth -= inBrick;
      if (end >= to) return share;
      t = max(t, end);
      leaveBrick(b);
      continue;
    }
    t += depth / majorant;
    share *= 1.0 - mediumAt(origin + t * dir).a / majorant;
    if (share < 0.1) {  // Russian roulette
      if (random() >= 0.5) return 0.0;
      share *= 2.0;
    }
    depth = -log(1.0 - random());
  }
  return share;
}
