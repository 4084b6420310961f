// Stub of the names from Unity's own include that the package's shaders use, to compile them without Unity.
// The matrices are those of one camera. With UNITY_STEREO_INSTANCING_ENABLED, they are those of the instance's eye.
#define CBUFFER_START(name) cbuffer name {
#define CBUFFER_END };
#define UNITY_BRANCH [branch]
#define UNITY_LOOP [loop]
#define UNITY_UNROLL [unroll]
#define UNITY_DECLARE_TEX3D(tex) Texture3D tex; SamplerState sampler##tex
#define UNITY_DECLARE_TEX2D(tex) Texture2D tex; SamplerState sampler##tex
#define UNITY_INITIALIZE_OUTPUT(type, name) name = (type)0
#define UNITY_PROJ_COORD(a) a

float4x4 unity_ObjectToWorld;
float4x4 unity_WorldToObject;
float4 _ProjectionParams;
float4 _ZBufferParams;

#ifdef UNITY_STEREO_INSTANCING_ENABLED
float4x4 unity_StereoMatrixV[2];
float4x4 unity_StereoMatrixVP[2];
float3 unity_StereoWorldSpaceCameraPos[2];
static uint unity_StereoEyeIndex;
#define UNITY_MATRIX_V unity_StereoMatrixV[unity_StereoEyeIndex]
#define UNITY_MATRIX_VP unity_StereoMatrixVP[unity_StereoEyeIndex]
#define _WorldSpaceCameraPos unity_StereoWorldSpaceCameraPos[unity_StereoEyeIndex]
#define UNITY_VERTEX_INPUT_INSTANCE_ID uint instanceID : SV_InstanceID;
#define UNITY_VERTEX_OUTPUT_STEREO uint stereoTargetEyeIndex : SV_RenderTargetArrayIndex;
#define UNITY_SETUP_INSTANCE_ID(input) unity_StereoEyeIndex = input.instanceID & 1
#define UNITY_TRANSFER_INSTANCE_ID(input, output) output.instanceID = input.instanceID
#define UNITY_INITIALIZE_VERTEX_OUTPUT_STEREO(output) output.stereoTargetEyeIndex = unity_StereoEyeIndex
#define UNITY_SETUP_STEREO_EYE_INDEX_POST_VERTEX(input) unity_StereoEyeIndex = input.stereoTargetEyeIndex
#define UNITY_DECLARE_DEPTH_TEXTURE(tex) Texture2DArray tex; SamplerState sampler##tex
#define SAMPLE_DEPTH_TEXTURE_PROJ(tex, uv) tex.Sample(sampler##tex, float3(uv.xy / uv.w, unity_StereoEyeIndex)).r
#else
float4x4 unity_MatrixV;
float4x4 unity_MatrixVP;
float3 _WorldSpaceCameraPos;
#define UNITY_MATRIX_V unity_MatrixV
#define UNITY_MATRIX_VP unity_MatrixVP
#define UNITY_VERTEX_INPUT_INSTANCE_ID
#define UNITY_VERTEX_OUTPUT_STEREO
#define UNITY_SETUP_INSTANCE_ID(input)
#define UNITY_TRANSFER_INSTANCE_ID(input, output)
#define UNITY_INITIALIZE_VERTEX_OUTPUT_STEREO(output)
#define UNITY_SETUP_STEREO_EYE_INDEX_POST_VERTEX(input)
#define UNITY_DECLARE_DEPTH_TEXTURE(tex) Texture2D tex; SamplerState sampler##tex
#define SAMPLE_DEPTH_TEXTURE_PROJ(tex, uv) tex.Sample(sampler##tex, uv.xy / uv.w).r
#endif

float4 UnityObjectToClipPos(float3 place)
{
    return mul(UNITY_MATRIX_VP, mul(unity_ObjectToWorld, float4(place, 1.0)));
}

float3 UnityObjectToViewPos(float3 place)
{
    return mul(UNITY_MATRIX_V, mul(unity_ObjectToWorld, float4(place, 1.0))).xyz;
}

float4 ComputeScreenPos(float4 clip)
{
    float2 half_ = 0.5 * float2(clip.x, clip.y * _ProjectionParams.x);
    return float4(half_ + 0.5 * clip.w, clip.zw);
}

float LinearEyeDepth(float z)
{
    return 1.0 / (_ZBufferParams.z * z + _ZBufferParams.w);
}

float3 LinearToGammaSpace(float3 light)
{
    return max(1.055 * pow(max(light, 0.0), 0.416666667) - 0.055, 0.0);
}
