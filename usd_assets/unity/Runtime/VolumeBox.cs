// SPDX-License-Identifier: Apache-2.0
using UnityEngine;

namespace StereoCell
{
    /// <summary>Draws up to four channels of a tile as a volume, by marching rays through a box. The voxels are loaded when
    /// they are to be shown.</summary>
    [ExecuteAlways, DisallowMultipleComponent, RequireComponent(typeof(MeshRenderer)), AddComponentMenu("")]
    public sealed class VolumeBox : MonoBehaviour
    {
        const int MostChannels = 4;
        const float LessEqual = 4, Always = 8;  // UnityEngine.Rendering.CompareFunction, as a material stores it

        static readonly int Volume = Shader.PropertyToID("_Volume");
        static readonly int Table = Shader.PropertyToID("_Table");
        static readonly int Size = Shader.PropertyToID("_Size");
        static readonly int Rows = Shader.PropertyToID("_Rows");
        static readonly int Shown = Shader.PropertyToID("_Shown");
        static readonly int Steps = Shader.PropertyToID("_Steps");
        static readonly int Shading = Shader.PropertyToID("_Shading");
        static readonly int SceneDepth = Shader.PropertyToID("_SceneDepth");
        static readonly int ZTest = Shader.PropertyToID("_ZTest");
        static readonly int[] ToBox = Each("_ToBox", 3);
        static readonly int[] Colors = Each("_Color", MostChannels);

        [Tooltip("Numbers of the channels in the specimen, from 0, in the order of the texture's components.")]
        public int[] channels = new int[0];

        [Tooltip("Name of the voxel file, which contains a hash of its content.")]
        public string file;

        [Tooltip("Number of texels: columns, rows and slices.")]
        public int[] size = new int[3];

        [HideInInspector] public string specimenGuid;  // GUID of the imported asset of the bundle
        [HideInInspector] public string[] sources = new string[0];  // files of the bundle, one for each channel
        [HideInInspector] public int level;  // mip level in these files

        VolumeLoad load;
        VolumeTexture texture;
        Material own;  // only in play mode
        MaterialPropertyBlock block;
        bool hasFailed;

        /// <summary>Whether any of its channels is visible.</summary>
        public bool IsShown { get; private set; }

        public bool IsLoaded
        {
            get { return texture != null; }
        }

        /// <summary>0 to 1. The share of the box's voxels that is in the texture; 1 after a failure.</summary>
        public float Progress
        {
            get { return IsLoaded || hasFailed ? 1 : load == null ? 0 : load.Progress; }
        }

        /// <summary>Continue loading. Returns whether nothing is left to load.</summary>
        public bool Advance(long mostBytes)
        {
            if (IsLoaded && texture.IsLost) Unload();
            if (IsLoaded || hasFailed) return true;
            if (load == null) load = new VolumeLoad(this);
            if (Application.isPlaying) load.Advance(mostBytes);
            else load.Finish();
            if (load.Error != null)
            {
                hasFailed = true;
                Debug.LogError(load.Error, this);
                load = null;
                return true;
            }
            if (!load.IsDone) return false;
            texture = load.Texture;
            load = null;
            Show();
            return true;
        }

        /// <summary>Free the voxels' memory.</summary>
        public void Unload()
        {
            if (load != null) load.Stop();
            load = null;
            if (texture != null) texture.Destroy();
            texture = null;
            hasFailed = false;
            if (own != null) own.SetTexture(Volume, null);
        }

        /// <summary>
        /// Apply the specimen's colours, transfer functions and settings to this box. In play mode they go into the box's
        /// own material, which the scriptable pipelines can batch. In the editor they go into a property block, so that no
        /// asset and no scene is changed.
        /// </summary>
        public void Apply(Specimen specimen)
        {
            var rendered = GetComponent<Renderer>();
            Vector4 rows = Vector4.zero, shown = Vector4.zero;
            var colors = new Vector4[MostChannels];
            for (var i = 0; i < channels.Length; i++)
            {
                var channel = specimen.channels[channels[i]];
                var linear = channel.color.linear;
                colors[i] = new Vector4(linear.r, linear.g, linear.b, 1);
                rows[i] = specimen.table == null ? 0 : (channel.firstRow + channel.function + 0.5f) / specimen.table.height;
                shown[i] = channel.isVisible ? 1 : 0;
            }
            IsShown = shown != Vector4.zero;
            rendered.enabled = IsShown;
            if (Application.isPlaying)
            {
                if (own == null) own = rendered.material;
                rendered.SetPropertyBlock(null);  // a block from the editor would override the material and prevent batching
                own.SetTexture(Table, specimen.Table);
                own.SetVector(Rows, rows);
                own.SetVector(Shown, shown);
                for (var i = 0; i < MostChannels; i++) own.SetVector(Colors[i], colors[i]);
                own.SetFloat(Steps, specimen.steps);
                own.SetFloat(Shading, specimen.shading);
                own.SetFloat(SceneDepth, specimen.endsAtSurfaces ? 1 : 0);
                own.SetFloat(ZTest, specimen.endsAtSurfaces ? Always : LessEqual);
            }
            else
            {
                if (block == null) block = new MaterialPropertyBlock();
                if (specimen.Table != null) block.SetTexture(Table, specimen.Table);
                block.SetVector(Rows, rows);
                block.SetVector(Shown, shown);
                for (var i = 0; i < MostChannels; i++) block.SetVector(Colors[i], colors[i]);
                block.SetFloat(Steps, specimen.steps);
                block.SetFloat(Shading, specimen.shading);
            }
            Show();
        }

        /// <summary>
        /// Distance from the eye to the box, um, summed over the box's axes. In a grid of boxes, this sum grows from box to
        /// box along every ray. Blending in falling order of this sum is therefore right, also for boxes of different
        /// sizes. Unity's own order, by the distance of the boxes' centres, is not.
        /// </summary>
        public float DistanceFrom(Vector3 eye)
        {
            var material = GetComponent<Renderer>().sharedMaterial;
            var local = transform.InverseTransformPoint(eye);
            var at = new Vector4(local.x, local.y, local.z, 1);
            var edges = material.GetVector(Size);
            float sum = 0;
            for (var axis = 0; axis < 3; axis++)
            {
                var place = Vector4.Dot(material.GetVector(ToBox[axis]), at);
                sum += Mathf.Max(0, Mathf.Max(-place, place - edges[axis]));
            }
            return sum;
        }

        void OnDestroy()
        {
            Unload();
            VolumeTexture.Discard(own);
        }

        void Show()
        {
            if (own != null)
            {
                own.SetTexture(Volume, IsLoaded ? texture.Texture : null);
            }
            else if (block != null)
            {
                if (IsLoaded) block.SetTexture(Volume, texture.Texture);
                GetComponent<Renderer>().SetPropertyBlock(block);
            }
        }

        static int[] Each(string name, int count)
        {
            var ids = new int[count];
            for (var i = 0; i < count; i++) ids[i] = Shader.PropertyToID(name + i);
            return ids;
        }
    }
}
