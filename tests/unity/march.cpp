// Marches rays with the Unity shader's own source, compiled as C++; textures are arrays.
// Standard input: sizes x y z, volume (4 channels), one row of the table for each channel, uniforms, rays. Standard
// output, for each ray: linear RGBA and the number of samples, as floats.
#include "hlsl.hpp"

static int size[3];
static std::vector<unsigned char> volume, tables;
static int samples = 0;

static float texel(int c, int x, int y, int z) {
    x = clamp(x, 0, size[0] - 1), y = clamp(y, 0, size[1] - 1), z = clamp(z, 0, size[2] - 1);
    return volume[4 * ((long(z) * size[1] + y) * size[0] + x) + c] / 255.0f;
}

float4 sampleIntensities(float3 p) {  // trilinear, clamped
    samples++;
    float at[3] = {p.x * size[0] - 0.5f, p.y * size[1] - 0.5f, p.z * size[2] - 0.5f};
    int low[3];
    float part[3];
    for (int i = 0; i < 3; i++) low[i] = int(std::floor(at[i])), part[i] = at[i] - low[i];
    float4 v(0, 0, 0, 0);
    for (int c = 0; c < 4; c++)
        for (int k = 0; k < 8; k++) {
            int s[3] = {k & 1, k >> 1 & 1, k >> 2};
            float w = 1;
            for (int i = 0; i < 3; i++) w *= s[i] ? part[i] : 1 - part[i];
            v[c] += w * texel(c, low[0] + s[0], low[1] + s[1], low[2] + s[2]);
        }
    return v;
}

float4 lookUp(int c, float intensity) {  // linear, between the centres of 256 texels
    float at = min(max(intensity * 255, 0.0f), 255.0f);
    int low = clamp(int(at), 0, 254);
    float4 v;
    for (int k = 0; k < 4; k++) {
        const unsigned char *row = &tables[4 * (256 * c + low) + k];
        v[k] = (row[0] + (at - low) * (row[4] - row[0])) / 255;
    }
    return v;
}

#include "march.hlsl"

template <class T> static void get(T *to, size_t n) {
    if (std::fread(to, sizeof(T), n, stdin) != n) std::exit(3);
}

static float4 vector() {
    float a[4];
    get(a, 4);
    return float4(a[0], a[1], a[2], a[3]);
}

static float3 direction() { return vector().xyz; }

int main() {
    get(size, 3);
    volume.resize(4l * size[0] * size[1] * size[2]);
    get(volume.data(), volume.size());
    tables.resize(4 * 4 * 256);
    get(tables.data(), tables.size());
    _Size = vector(), _TexLow = vector(), _TexHigh = vector(), _AllLow = vector(), _AllHigh = vector();
    _Shown = vector();
    _Color0 = vector(), _Color1 = vector(), _Color2 = vector(), _Color3 = vector();
    float4 numbers = vector();
    _Voxel = numbers.x, _MinStep = numbers.y, _Steps = numbers.z, _Spare = numbers.w;
    numbers = vector();
    _Shading = numbers.x;
    float shift = numbers.y;
    Room room;
    room.key = direction(), room.fill = direction(), room.up = direction();
    int rays;
    get(&rays, 1);
    for (int i = 0; i < rays; i++) {
        float4 eye = vector(), dir = vector();  // eye.w is the distance of the scene
        samples = 0;
        float4 light = march(eye.xyz, dir.xyz, eye.w, shift, room);
        float out[5] = {light.x, light.y, light.z, light.w, float(samples)};
        std::fwrite(out, sizeof(float), 5, stdout);
    }
}
