// Draws the volume in the box of one tile by ray marching. The back faces of the box are drawn, so that the volume is
// visible also when the eye is inside. One sub-shader is for the universal pipeline and one for the built-in pipeline;
// they differ in one include. Both can draw the two eyes in one pass (single-pass instanced) or separately, depending
// on the XR plug-in. The material has no keywords, so all boxes share one shader variant.
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
        [HideInInspector] _Rows ("Rows of the table", Vector) = (0, 0, 0, 0)
        [HideInInspector] _Shown ("Channels that show", Vector) = (0, 0, 0, 0)
        [HideInInspector] _Color0 ("Linear colour of the first channel", Vector) = (1, 1, 1, 1)
        [HideInInspector] _Color1 ("Linear colour of the second channel", Vector) = (1, 1, 1, 1)
        [HideInInspector] _Color2 ("Linear colour of the third channel", Vector) = (1, 1, 1, 1)
        [HideInInspector] _Color3 ("Linear colour of the fourth channel", Vector) = (1, 1, 1, 1)
        [HideInInspector] _Voxel ("Finest voxel spacing, um", Float) = 1
        [HideInInspector] _MinStep ("Shortest step, um", Float) = 1
        [HideInInspector] _Spare ("Steps kept for other tiles", Float) = 0
        _Steps ("Steps of a ray", Range(1, 100)) = 100
        _Shading ("Shading", Range(0, 1)) = 1
        _Grain ("Grain in place of bands", Range(0, 1)) = 1
        [HideInInspector] _SceneDepth ("1: rays end at surfaces (needs the camera's depth texture)", Float) = 0
        [HideInInspector] _ZTest ("LEqual; Always where rays end at surfaces", Float) = 4
    }
    SubShader
    {
        PackageRequirements { "com.unity.render-pipelines.universal": "14.0.0" }
        Tags
        {
            "RenderPipeline" = "UniversalPipeline"
            "Queue" = "Transparent"
            "RenderType" = "Transparent"
            "IgnoreProjector" = "True"
        }
        Pass
        {
            Name "Volume"
            Tags { "LightMode" = "UniversalForwardOnly" }
            Cull Front
            ZWrite Off
            ZTest [_ZTest]
            Blend One OneMinusSrcAlpha

            HLSLPROGRAM
            #pragma target 3.5
            #pragma vertex vert
            #pragma fragment frag
            #pragma multi_compile_instancing
            #include "universal.hlsl"
            #include "volume_pass.hlsl"
            ENDHLSL
        }
    }
    SubShader
    {
        Tags { "Queue" = "Transparent" "RenderType" = "Transparent" "IgnoreProjector" = "True" }
        Pass
        {
            Name "Volume"
            Cull Front
            ZWrite Off
            ZTest [_ZTest]
            Blend One OneMinusSrcAlpha

            CGPROGRAM
            #pragma target 3.5
            #pragma vertex vert
            #pragma fragment frag
            #pragma multi_compile_instancing
            #include "builtin.hlsl"
            #include "volume_pass.hlsl"
            ENDCG
        }
    }
}
