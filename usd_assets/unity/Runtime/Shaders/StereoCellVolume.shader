// The box of one tile, whose volume is marched. Its back faces are drawn, so that the ray is there also when
// the eye is inside. Works in the built-in pipeline and, as an unlit pass without a LightMode, in the
// universal one. One pass for both eyes (single-pass instanced) and for each eye by itself.
Shader "StereoCell/Volume"
{
    Properties
    {
        [NoScaleOffset] _Volume ("Channels, side by side", 3D) = "black" {}
        [NoScaleOffset] _Table ("Transfer functions, a row each", 2D) = "black" {}
        [HideInInspector] _Size ("Edges, um", Vector) = (1, 1, 1, 0)
        [HideInInspector] _TexLow ("Texture coordinates, low corner", Vector) = (0, 0, 0, 0)
        [HideInInspector] _TexHigh ("Texture coordinates, high corner", Vector) = (1, 1, 1, 0)
        [HideInInspector] _AllLow ("All tiles, low corner, um", Vector) = (0, 0, 0, 0)
        [HideInInspector] _AllHigh ("All tiles, high corner, um", Vector) = (1, 1, 1, 0)
        [HideInInspector] _ToBox0 ("To the box, x", Vector) = (1, 0, 0, 0)
        [HideInInspector] _ToBox1 ("To the box, y", Vector) = (0, 1, 0, 0)
        [HideInInspector] _ToBox2 ("To the box, z", Vector) = (0, 0, 1, 0)
        [HideInInspector] _Voxel ("Finest voxel spacing, um", Float) = 1
        [HideInInspector] _MinStep ("Shortest step, um", Float) = 1
        [HideInInspector] _Spare ("Steps kept for other tiles", Float) = 0
        _Steps ("Steps of a ray", Range(1, 100)) = 100
        _Shading ("Shading", Range(0, 1)) = 1
        _Grain ("Grain in place of bands", Range(0, 1)) = 1
        [Toggle(STEREOCELL_SCENE_DEPTH)] _SceneDepth ("End at surfaces (wants the camera's depth texture)", Float) = 0
        [HideInInspector] _ZTest ("LEqual; Always where rays end at surfaces", Float) = 4
    }
    SubShader
    {
        Tags { "Queue" = "Transparent" "RenderType" = "Transparent" "IgnoreProjector" = "True" }
        Pass
        {
            Cull Front
            ZWrite Off
            ZTest [_ZTest]
            Blend One OneMinusSrcAlpha

            CGPROGRAM
            #pragma target 3.5
            #pragma vertex vert
            #pragma fragment frag
            #pragma multi_compile_instancing
            // not shader_feature: a player may turn it on that was built without
            #pragma multi_compile_local_fragment _ STEREOCELL_SCENE_DEPTH
            #include "UnityCG.cginc"

            UNITY_DECLARE_TEX3D(_Volume);
            UNITY_DECLARE_TEX2D(_Table);
            float4 _Rows;  // where each channel's transfer function lies in the table, 0..1
            float4 _ToBox0;
            float4 _ToBox1;
            float4 _ToBox2;
            float _Grain;
            #ifdef STEREOCELL_SCENE_DEPTH
            UNITY_DECLARE_DEPTH_TEXTURE(_CameraDepthTexture);
            #endif

            float4 sampleIntensities(float3 p)
            {
                return _Volume.SampleLevel(sampler_Volume, p, 0);
            }

            float4 lookUp(int c, float intensity)
            {
                float2 at = float2((intensity * 255.0 + 0.5) / 256.0, _Rows[c]);
                return _Table.SampleLevel(sampler_Table, at, 0);
            }

            #include "march.hlsl"

            struct Vertex
            {
                float4 position : POSITION;
                UNITY_VERTEX_INPUT_INSTANCE_ID
            };

            struct Fragment
            {
                float4 clip : SV_POSITION;
                float3 place : TEXCOORD0;  // um, the box's space
                float4 screen : TEXCOORD1;
                float viewDepth : TEXCOORD2;  // world units
                UNITY_VERTEX_INPUT_INSTANCE_ID
                UNITY_VERTEX_OUTPUT_STEREO
            };

            float3 toBox(float4 object)
            {
                return float3(dot(_ToBox0, object), dot(_ToBox1, object), dot(_ToBox2, object));
            }

            float3 directionInBox(float3 world)
            {
                float3 object = mul((float3x3)unity_WorldToObject, world);
                return normalize(toBox(float4(object, 0.0)));
            }

            // Towards a lamp of the room that hangs in the eye's axes: right, up, back.
            float3 lampInBox(float3 inEye)
            {
                return directionInBox(mul(inEye, (float3x3)UNITY_MATRIX_V));
            }

            Fragment vert(Vertex vertex)
            {
                Fragment o;
                UNITY_SETUP_INSTANCE_ID(vertex);
                UNITY_INITIALIZE_OUTPUT(Fragment, o);
                UNITY_TRANSFER_INSTANCE_ID(vertex, o);
                UNITY_INITIALIZE_VERTEX_OUTPUT_STEREO(o);
                float4 object = float4(vertex.position.xyz, 1.0);
                o.clip = UnityObjectToClipPos(object.xyz);
                o.place = toBox(object);
                o.screen = ComputeScreenPos(o.clip);
                o.viewDepth = -UnityObjectToViewPos(object.xyz).z;
                return o;
            }

            float4 frag(Fragment i) : SV_Target
            {
                UNITY_SETUP_INSTANCE_ID(i);
                UNITY_SETUP_STEREO_EYE_INDEX_POST_VERTEX(i);
                float3 eye = toBox(mul(unity_WorldToObject, float4(_WorldSpaceCameraPos, 1.0)));
                float3 ray = i.place - eye;
                float back = length(ray);
                float scene = 1e30;
                #ifdef STEREOCELL_SCENE_DEPTH
                float raw = SAMPLE_DEPTH_TEXTURE_PROJ(_CameraDepthTexture, UNITY_PROJ_COORD(i.screen));
                scene = back * LinearEyeDepth(raw) / i.viewDepth;
                #endif
                Room room;
                room.key = lampInBox(float3(-1.2, 1.6, 2.5));
                room.fill = lampInBox(float3(1.8, -0.4, 1.8));
                room.up = directionInBox(float3(0.0, 1.0, 0.0));
                float shift = lerp(0.5, grain(i.clip.xy), _Grain);
                float4 light = march(eye, ray / back, scene, shift, room);
                #ifdef UNITY_COLORSPACE_GAMMA
                light.rgb = LinearToGammaSpace(light.rgb / max(light.a, 1e-6)) * light.a;
                #endif
                return light;
            }
            ENDCG
        }
    }
}
