// How a path continues where it hits the medium. There are three ways. Each is sampled by its own
// density, so the density equals the value, and the weight of a path is the scattering colour
// alone. PHASE: Henyey & Greenstein 1941. DIFFUSE: Lambert's cosine. GLOSSY: a normalised Phong
// lobe around the mirrored ray (Lafortune & Willems 1994); its part below the surface is folded up,
// so that no light is lost.
const int PHASE = 0;
const int DIFFUSE = 1;
const int GLOSSY = 2;
const float PI = 3.14159265358979;

struct Scatter {
  int way;
  vec3 normal;  // the surface's normal, on the side from which the ray comes
  vec3 mirrored;
};

// A unit vector at an angle of the given cosine to `axis`, rotated about it by `turn` of a full
// turn.
vec3 around(vec3 axis, float cosine, float turn) {
  // Duff et al., JCGT 2017
  float s = axis.z >= 0.0 ? 1.0 : -1.0;
  float a = -1.0 / (s + axis.z);
  float b = axis.x * axis.y * a;
  vec3 u = vec3(1.0 + s * axis.x * axis.x * a, s * b, -s * axis.x);
  vec3 v = vec3(b, s + axis.y * axis.y * a, -axis.y);
  float phi = 2.0 * PI * turn;
  float sine = sqrt(max(0.0, 1.0 - cosine * cosine));
  return normalize(sine * (cos(phi) * u + sin(phi) * v) + cosine * axis);
}

// Density per steradian of continuing along `to` after arriving along `from`.
float scatterDensity(Scatter s, vec3 from, vec3 to) {
  if (s.way == PHASE) {
    float g = uAnisotropy;
    float k = max(1.0 + g * g - 2.0 * g * dot(from, to), 1e-6);
    return (1.0 - g * g) / (4.0 * PI * k * sqrt(k));
  }
  float height = dot(to, s.normal);
  if (height <= 0.0) return 0.0;
  if (s.way == DIFFUSE) return height / PI;
  vec3 folded = to - 2.0 * height * s.normal;
  vec2 lobe = pow(max(vec2(dot(to, s.mirrored), dot(folded, s.mirrored)), 0.0), vec2(uGloss));
  return (uGloss + 1.0) / (2.0 * PI) * (lobe.x + lobe.y);
}

vec3 sampleScatter(Scatter s, vec3 from) {
  float x = random();
  float turn = random();
  if (s.way == PHASE) {
    float g = uAnisotropy;
    float part = (1.0 - g * g) / (1.0 - g + 2.0 * g * x);
    float cosine = abs(g) < 1e-3 ? 1.0 - 2.0 * x : (1.0 + g * g - part * part) / (2.0 * g);
    return around(from, clamp(cosine, -1.0, 1.0), turn);
  }
  if (s.way == DIFFUSE) return around(s.normal, sqrt(1.0 - x), turn);
  vec3 to = around(s.mirrored, pow(1.0 - x, 1.0 / (uGloss + 1.0)), turn);
  float height = dot(to, s.normal);
  return height < 0.0 ? to - 2.0 * height * s.normal : to;
}
