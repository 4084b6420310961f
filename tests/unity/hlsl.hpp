// The parts of HLSL that march.hlsl uses, so that it compiles as C++.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

struct float2 {
    float x, y;
    float2() = default;
    float2(float a, float b) : x(a), y(b) {}
};

struct float3 {
    float x, y, z;
    float3() = default;
    float3(float a, float b, float c) : x(a), y(b), z(c) {}
};

struct float4 {
    union {
        struct { float x, y, z, w; };
        struct { float r, g, b, a; };
        float3 xyz, rgb;
        float at[4];
    };
    float4() = default;
    float4(float a, float b, float c, float d) : x(a), y(b), z(c), w(d) {}
    float &operator[](int i) { return at[i]; }
};

#define EACH(op) \
    inline float3 operator op(float3 a, float3 b) { return float3(a.x op b.x, a.y op b.y, a.z op b.z); } \
    inline float3 operator op(float3 a, float b) { return a op float3(b, b, b); } \
    inline float3 operator op(float a, float3 b) { return float3(a, a, a) op b; } \
    inline float4 operator op(float4 a, float4 b) { return float4(a.x op b.x, a.y op b.y, a.z op b.z, a.w op b.w); } \
    inline float4 operator op(float4 a, float b) { return a op float4(b, b, b, b); } \
    inline float4 operator op(float a, float4 b) { return float4(a, a, a, a) op b; }
EACH(+)
EACH(-)
EACH(*)
EACH(/)
inline float3 operator-(float3 a) { return float3(-a.x, -a.y, -a.z); }
inline float3 &operator+=(float3 &a, float3 b) { return a = a + b; }
inline float4 &operator+=(float4 &a, float4 b) { return a = a + b; }

inline float min(float a, float b) { return a < b ? a : b; }
inline float max(float a, float b) { return a > b ? a : b; }
inline float3 min(float3 a, float3 b) { return float3(min(a.x, b.x), min(a.y, b.y), min(a.z, b.z)); }
inline float3 max(float3 a, float3 b) { return float3(max(a.x, b.x), max(a.y, b.y), max(a.z, b.z)); }
inline int clamp(int a, int low, int high) { return a < low ? low : a > high ? high : a; }
inline float abs(float a) { return a < 0 ? -a : a; }
inline float3 abs(float3 a) { return float3(abs(a.x), abs(a.y), abs(a.z)); }
inline float sign(float a) { return float((a > 0) - (a < 0)); }
inline float3 sign(float3 a) { return float3(sign(a.x), sign(a.y), sign(a.z)); }
inline float frac(float a) { return a - std::floor(a); }
inline float dot(float3 a, float3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline float dot(float4 a, float4 b) { return a.x * b.x + a.y * b.y + a.z * b.z + a.w * b.w; }
inline float length(float3 a) { return std::sqrt(dot(a, a)); }
inline float3 normalize(float3 a) { return a / length(a); }
inline float3 lerp(float3 a, float3 b, float t) { return a + t * (b - a); }
inline float smoothstep(float low, float high, float a) {
    float t = min(max((a - low) / (high - low), 0.0f), 1.0f);
    return t * t * (3 - 2 * t);
}
inline float pow(float a, float b) { return std::pow(a, b); }

#define CBUFFER_START(name)
#define CBUFFER_END
#define UNITY_LOOP
#define UNITY_UNROLL
