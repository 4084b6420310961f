// SPDX-License-Identifier: Apache-2.0
using System;
using System.Collections.Generic;
using UnityEngine;

namespace StereoCell
{
    /// <summary>A channel of the specimen: what it is called, and how it looks.</summary>
    [Serializable]
    public sealed class Channel
    {
        public string id;
        public string name;

        public Color color = Color.white;

        /// <summary>As it was imported: then its surfaces keep their materials as they are.</summary>
        [HideInInspector] public Color importedColor;

        public bool isVisible = true;

        [Tooltip("Names of the transfer functions; each is a row of the specimen's table")]
        public string[] functions;

        [Tooltip("The chosen one, by its place")]
        public int function;

        [HideInInspector] public int firstRow;

        /// <summary>Objects that hold the channel's surfaces, one a tile.</summary>
        [HideInInspector] public List<GameObject> surfaces = new List<GameObject>();
    }

    /// <summary>The whole: shows and hides channels, and chooses colours and transfer functions.</summary>
    [ExecuteAlways, DisallowMultipleComponent, AddComponentMenu("StereoCell/Specimen")]
    public sealed class Specimen : MonoBehaviour
    {
        const string SceneDepth = "STEREOCELL_SCENE_DEPTH";
        const float LessEqual = 4, Always = 8;  // UnityEngine.Rendering.CompareFunction, as a material stores it

        public List<Channel> channels = new List<Channel>();

        [Tooltip("Transfer functions: 256 texels of intensity, a row each")]
        public Texture2D table;

        [Range(1, 100), Tooltip("Most steps of a ray through all tiles")]
        public int steps = 100;

        [Range(0, 1), Tooltip("By how much volumes are lit")]
        public float shading = 1;

        [Tooltip("Rays end at surfaces: wants the camera's depth texture")]
        public bool endsAtSurfaces;

        MaterialPropertyBlock block;
        VolumeBox[] boxes;  // kept, so that a frame allocates nothing
        float[] nearness;

        /// <summary>The channel of this id or name; null if there is none.</summary>
        public Channel Find(string idOrName)
        {
            return channels.Find(channel => channel.id == idOrName || channel.name == idOrName);
        }

        public void SetVisible(string channel, bool isVisible)
        {
            Known(channel).isVisible = isVisible;
            Apply();
        }

        public void SetColor(string channel, Color color)
        {
            Known(channel).color = color;
            Apply();
        }

        public void SetFunction(string channel, string function)
        {
            var known = Known(channel);
            var index = Array.IndexOf(known.functions, function);
            if (index < 0) throw new ArgumentException(channel + " has no transfer function " + function);
            known.function = index;
            Apply();
        }

        void OnEnable()
        {
            Apply();
        }

        void OnValidate()
        {
            Apply();
        }

        /// <summary>Carry to the renderers what was changed in the fields.</summary>
        public void Apply()
        {
            if (block == null) block = new MaterialPropertyBlock();
            foreach (var channel in channels)
            {
                block.Clear();
                block.SetColor("baseColorFactor", channel.color);  // of glTFast's materials; Unity makes it linear
                foreach (var surface in channel.surfaces)
                {
                    if (surface == null) continue;
                    foreach (var renderer in surface.GetComponentsInChildren<Renderer>(true))
                    {
                        renderer.enabled = channel.isVisible;  // not SetActive: this may run in OnValidate
                        renderer.SetPropertyBlock(channel.color == channel.importedColor ? null : block);
                    }
                }
            }
            boxes = GetComponentsInChildren<VolumeBox>(true);
            nearness = new float[boxes.Length];
            foreach (var box in boxes) Apply(box);
            if (endsAtSurfaces && Camera.main != null) Camera.main.depthTextureMode |= DepthTextureMode.Depth;
        }

        void LateUpdate()
        {
            if (Camera.main != null) SortFrom(Camera.main.transform.position);
        }

        /// <summary>Blend volumes from the farthest, for an eye in the world: done for the main camera by itself.</summary>
        public void SortFrom(Vector3 eye)
        {
            if (boxes == null || Array.Exists(boxes, box => box == null)) Apply();  // some were removed
            for (var i = 0; i < boxes.Length; i++) nearness[i] = -boxes[i].DistanceFrom(eye);
            Array.Sort(nearness, boxes);
            // up to 0, so that what else is transparent is blended after them
            for (var i = 0; i < boxes.Length; i++) boxes[i].GetComponent<Renderer>().sortingOrder = i + 1 - boxes.Length;
        }

        void Apply(VolumeBox box)
        {
            var colors = new Vector4[4];
            Vector4 rows = Vector4.zero, shown = Vector4.zero;
            for (var i = 0; i < box.channels.Length; i++)
            {
                var channel = channels[box.channels[i]];
                var linear = channel.color.linear;
                colors[i] = new Vector4(linear.r, linear.g, linear.b, 1);
                rows[i] = table == null ? 0 : (channel.firstRow + channel.function + 0.5f) / table.height;
                shown[i] = channel.isVisible ? 1 : 0;
            }
            block.Clear();
            block.SetVectorArray("_Colors", colors);
            block.SetVector("_Rows", rows);
            block.SetVector("_Shown", shown);
            block.SetFloat("_Steps", steps);
            block.SetFloat("_Shading", shading);
            var renderer = box.GetComponent<Renderer>();
            renderer.SetPropertyBlock(block);
            renderer.enabled = shown != Vector4.zero;
            var material = renderer.sharedMaterial;
            if (material == null || material.IsKeywordEnabled(SceneDepth) == endsAtSurfaces) return;
            if (endsAtSurfaces) material.EnableKeyword(SceneDepth);
            else material.DisableKeyword(SceneDepth);
            material.SetFloat("_SceneDepth", endsAtSurfaces ? 1 : 0);
            material.SetFloat("_ZTest", endsAtSurfaces ? Always : LessEqual);
        }

        Channel Known(string idOrName)
        {
            var channel = Find(idOrName);
            if (channel == null) throw new ArgumentException("the specimen has no channel " + idOrName);
            return channel;
        }
    }
}
