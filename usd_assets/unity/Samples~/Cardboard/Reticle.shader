// Draws the reticle in front of everything, in both eyes. Both render pipelines draw a pass that has no LightMode.
Shader "StereoCell/Reticle"
{
    Properties
    {
        _Color ("Colour", Color) = (1, 1, 1, 1)
    }
    SubShader
    {
        Tags { "Queue" = "Overlay" "RenderType" = "Transparent" "IgnoreProjector" = "True" }
        Pass
        {
            Cull Off
            ZWrite Off
            ZTest Always
            Blend SrcAlpha OneMinusSrcAlpha

            CGPROGRAM
            #pragma target 3.5
            #pragma vertex vert
            #pragma fragment frag
            #pragma multi_compile_instancing
            #include "UnityCG.cginc"

            CBUFFER_START(UnityPerMaterial)
            float4 _Color;
            CBUFFER_END

            struct Vertex
            {
                float4 position : POSITION;
                UNITY_VERTEX_INPUT_INSTANCE_ID
            };

            struct Fragment
            {
                float4 clip : SV_POSITION;
                UNITY_VERTEX_OUTPUT_STEREO
            };

            Fragment vert(Vertex vertex)
            {
                Fragment o;
                UNITY_SETUP_INSTANCE_ID(vertex);
                UNITY_INITIALIZE_OUTPUT(Fragment, o);
                UNITY_INITIALIZE_VERTEX_OUTPUT_STEREO(o);
                o.clip = UnityObjectToClipPos(vertex.position.xyz);
                return o;
            }

            float4 frag(Fragment i) : SV_Target
            {
                return _Color;
            }
            ENDCG
        }
    }
}
