// SPDX-License-Identifier: Apache-2.0
using System;
using System.Collections.Generic;
using UnityEngine;

namespace StereoCell
{
    /// <summary>A channel of the specimen: its name and its appearance.</summary>
    [Serializable]
    public sealed class Channel
    {
        public string id;
        public string name;

        public Color color = Color.white;

        // Values at the import. An edit is a difference from them. Surfaces with the imported colour keep their material.
        [HideInInspector] public Color importedColor;
        [HideInInspector] public bool importedVisible = true;
        [HideInInspector] public int importedFunction;

        public bool isVisible = true;

        [Tooltip("Names of the channel's transfer functions. Each function is a row of the specimen's table.")]
        public string[] functions;

        [Tooltip("Number of the chosen transfer function, from 0.")]
        public int function;

        [HideInInspector] public int firstRow;

        /// <summary>The objects with the channel's surfaces, one for each tile.</summary>
        [HideInInspector] public List<GameObject> surfaces = new List<GameObject>();
    }

    /// <summary>The whole specimen. It shows and hides channels, sets colours and transfer functions, and keeps the
    /// voxels of the most recently viewed tiles in memory.</summary>
    [ExecuteAlways, DisallowMultipleComponent, AddComponentMenu("StereoCell/Specimen")]
    public sealed class Specimen : MonoBehaviour
    {
        /// <summary>Bytes to upload in one frame, which takes about 2 ms on a phone.</summary>
        const long UploadBytes = 2 << 20;

        public List<Channel> channels = new List<Channel>();

        [Tooltip("Transfer functions of all channels. Each is a row of 256 texels, one for each intensity.")]
        public Texture2D table;

        [Range(1, 100), Tooltip("Largest number of steps of a ray through all tiles.")]
        public int steps = 100;

        [Range(0, 1), Tooltip("Strength of the light on volumes: with 0 they are not shaded.")]
        public float shading = 1;

        [Tooltip("Whether rays end at surfaces, in play mode. This needs the camera's depth texture.")]
        public bool endsAtSurfaces;

        [Min(1), Tooltip("Largest memory of all volumes, in MB. As many of the most recently viewed tiles stay loaded as fit.")]
        public float budget = 40;

        readonly Residency<Tile> residency = new Residency<Tile>();
        Texture2D ownTable;  // copy of the table with edited functions
        SurfaceColors colors;
        VolumeBox[] boxes;  // kept between frames, so that a frame allocates no memory
        float[] nearness;

        /// <summary>The channel with this id or name; null if there is none.</summary>
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

        /// <summary>Change a transfer function until the scene is closed. The imported table is not changed.</summary>
        /// <param name="opacity">Opacities 0 to 255, one for each of 256 intensities.</param>
        public void SetOpacity(string channel, string function, byte[] opacity)
        {
            var known = Known(channel);
            var index = Array.IndexOf(known.functions, function);
            if (index < 0) throw new ArgumentException(channel + " has no transfer function " + function);
            if (opacity.Length != table.width) throw new ArgumentException("found " + opacity.Length + " opacities, expected " + table.width + ", one for each intensity");
            var texels = Table.GetRawTextureData();
            for (var i = 0; i < opacity.Length; i++) texels[4 * (table.width * (known.firstRow + index) + i) + 3] = opacity[i];
            if (ownTable == null)
            {
                ownTable = new Texture2D(table.width, table.height, TextureFormat.RGBA32, false, true)
                {
                    wrapMode = TextureWrapMode.Clamp,
                    filterMode = FilterMode.Bilinear,
                    hideFlags = HideFlags.HideAndDontSave,
                };
            }
            ownTable.LoadRawTextureData(texels);
            ownTable.Apply(false, false);
            Apply();
        }

        /// <summary>The table of transfer functions in use: the edited copy, or the imported table.</summary>
        public Texture2D Table
        {
            get { return ownTable != null ? ownTable : table; }
        }

        /// <summary>Bytes. The peak memory of the volumes that are loaded or being loaded.</summary>
        public long VolumeBytes
        {
            get { return residency.Bytes; }
        }

        /// <summary>Load the voxels of a tile. If they do not fit into the budget, the least recently requested tiles are
        /// unloaded first.</summary>
        public void Load(Tile tile)
        {
            residency.Budget = (long)(budget * 1e6f);
            foreach (var leaving in residency.Admit(tile, tile.PeakBytes))
            {
                if (leaving != null) leaving.Unload();
            }
            if (!Application.isPlaying) tile.Advance(long.MaxValue);
        }

        void OnEnable()
        {
            Apply();
            OpenTiles();
        }

        void OnDisable()
        {
            foreach (var tile in new List<Tile>(residency.Items))
            {
                residency.Remove(tile);
                if (tile == null) continue;
                foreach (var box in tile.GetComponentsInChildren<VolumeBox>(true)) box.Unload();
            }
        }

        void OnDestroy()
        {
            if (colors != null) colors.Destroy();
            VolumeTexture.Discard(ownTable);
        }

        void OnValidate()
        {
            if (isActiveAndEnabled) Apply();  // the asset itself is not in a scene and is not drawn
        }

        void Update()
        {
            var items = residency.Items;
            for (var i = 0; i < items.Count; i++)
            {
                if (items[i] != null) items[i].Advance(UploadBytes);
            }
        }

        /// <summary>Load the tiles that show volumes, in their order. A tile that does not fit shows its surfaces.</summary>
        void OpenTiles()
        {
            long bytes = 0;
            foreach (var tile in GetComponentsInChildren<Tile>(true))
            {
                if (!tile.ShowsVolume) continue;
                var peak = tile.PeakBytes;
                var fits = bytes == 0 || bytes + peak <= (long)(budget * 1e6f);
                if (fits)
                {
                    bytes += peak;
                    var hasSurfaces = tile.surfaces != null && tile.surfaces.activeSelf;
                    if (Application.isPlaying) tile.volume.SetActive(false);
                    tile.Show(hasSurfaces, true);
                }
                else if (Application.isPlaying) tile.Show(true, false);
            }
        }

        /// <summary>Apply the fields of specimen and channels to the renderers of surfaces and volumes.</summary>
        public void Apply()
        {
            if (colors == null) colors = new SurfaceColors();
            foreach (var channel in channels)
            {
                foreach (var surface in channel.surfaces)
                {
                    if (surface == null) continue;
                    foreach (var renderer in surface.GetComponentsInChildren<Renderer>(true))
                    {
                        renderer.enabled = channel.isVisible;  // SetActive is not allowed in OnValidate
                        colors.Apply(renderer, channel);
                    }
                }
            }
            boxes = GetComponentsInChildren<VolumeBox>(true);
            nearness = new float[boxes.Length];
            foreach (var box in boxes) box.Apply(this);
            if (endsAtSurfaces && Camera.main != null) Camera.main.depthTextureMode |= DepthTextureMode.Depth;
        }

        void LateUpdate()
        {
            if (Camera.main != null) SortFrom(Camera.main.transform.position);
        }

        /// <summary>Order the volumes for blending, farthest first, as seen from a point of the world. For the main camera
        /// this happens in each frame.</summary>
        public void SortFrom(Vector3 eye)
        {
            if (boxes == null || Array.Exists(boxes, box => box == null)) Apply();  // some were removed
            for (var i = 0; i < boxes.Length; i++) nearness[i] = -boxes[i].DistanceFrom(eye);
            Array.Sort(nearness, boxes);
            // The highest order is 0, so that other transparent objects are blended after all volumes.
            for (var i = 0; i < boxes.Length; i++) boxes[i].GetComponent<Renderer>().sortingOrder = i + 1 - boxes.Length;
        }

        Channel Known(string idOrName)
        {
            var channel = Find(idOrName);
            if (channel == null) throw new ArgumentException("the specimen has no channel " + idOrName);
            return channel;
        }
    }
}
