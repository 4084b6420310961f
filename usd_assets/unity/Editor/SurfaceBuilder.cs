// SPDX-License-Identifier: Apache-2.0
using System;
using System.Collections.Generic;
using UnityEngine;
using Object = UnityEngine.Object;

namespace StereoCell.Editor
{
    /// <summary>Makes the surfaces of a tile and a channel, with their levels of detail.</summary>
    sealed class SurfaceBuilder
    {
        readonly Bundle bundle;
        readonly ImportOptions options;
        readonly Func<string, Material> ownMaterial;
        readonly Action<string, Object> addAsset;
        readonly Dictionary<string, Material> materials = new Dictionary<string, Material>();
        readonly HashSet<string> channelsWithMaterial = new HashSet<string>();

        /// <param name="ownMaterial">Returns the project's material for a channel's surfaces; null keeps the bundle's
        /// materials.</param>
        public SurfaceBuilder(Bundle bundle, ImportOptions options, Func<string, Material> ownMaterial, Action<string, Object> addAsset)
        {
            this.bundle = bundle;
            this.options = options;
            this.ownMaterial = ownMaterial;
            this.addAsset = addAsset;
        }

        /// <param name="pivot">Metres. Position of the tile's object in the specimen.</param>
        public GameObject AddSurface(Transform parent, ChannelEntry channel, TileEntry tile, List<Level> levels, Vector3 pivot)
        {
            var holder = new GameObject(channel.Id);
            holder.transform.SetParent(parent, false);
            var size = Placement.SizeOf(tile.Bounds);
            var edge = Mathf.Max(size.x, Mathf.Max(size.y, size.z));
            var heights = Placement.LodHeights(levels, edge, options.errorPixels, options.screenPixels);
            var lods = new LOD[levels.Count];
            for (var i = 0; i < levels.Count; i++)
            {
                var surface = Surface.Read(levels[i].Path, bundle.Read(levels[i].Path));
                surface.Made.name = "lod" + i;
                surface.Made.transform.SetParent(holder.transform, false);
                surface.Made.transform.localPosition -= pivot;  // the file has the specimen's coordinates
                AddParts(surface, channel.Id, tile.Id, channel.Id + " " + tile.Id + " lod" + i);
                lods[i] = new LOD(heights[i], surface.Made.GetComponentsInChildren<Renderer>());
            }
            var group = holder.AddComponent<LODGroup>();
            group.SetLODs(lods);
            group.localReferencePoint = Vector3.zero;
            group.size = edge;
            return holder;
        }

        /// <summary>Add a file's meshes, images and materials to the asset.</summary>
        void AddParts(Surface surface, string channel, string tile, string name)
        {
            var filters = surface.Made.GetComponentsInChildren<MeshFilter>(true);
            for (var i = 0; i < filters.Length; i++)
            {
                if (filters[i].sharedMesh != null) addAsset("mesh " + name + Numbered(i), filters[i].sharedMesh);
            }
            var own = ownMaterial(channel);
            var renderers = surface.Made.GetComponentsInChildren<Renderer>(true);
            for (var i = 0; i < renderers.Length; i++)
            {
                var made = renderers[i].sharedMaterial;
                renderers[i].sharedMaterial = own != null ? own : Shared(made, surface.MaterialText, channel, tile, name + Numbered(i));
                if (made != null && renderers[i].sharedMaterial != made) Object.DestroyImmediate(made);
            }
            for (var i = 0; i < surface.Textures.Length; i++)
            {
                if (own == null) addAsset("image " + name + Numbered(i), surface.Textures[i]);
                else Object.DestroyImmediate(surface.Textures[i]);
            }
        }

        /// <summary>The one material for all surfaces of a channel whose files describe the same material.</summary>
        Material Shared(Material made, string text, string channel, string tile, string name)
        {
            if (made == null) return null;
            if (text == null)
            {
                addAsset("material " + name, made);
                return made;
            }
            Material found;
            var key = channel + " " + text;
            if (materials.TryGetValue(key, out found)) return found;
            materials.Add(key, made);
            // The channel's first material gets its name. A different material gets the name of its tile as well.
            made.name = channelsWithMaterial.Add(channel) ? channel : channel + " " + tile;
            addAsset("material " + (made.name == channel ? channel : name), made);
            return made;
        }

        static string Numbered(int i)
        {
            return i == 0 ? "" : " " + i;
        }
    }
}
