// SPDX-License-Identifier: Apache-2.0
using System;
using System.Collections.Generic;
using System.Linq;
using UnityEngine;
using Object = UnityEngine.Object;

namespace StereoCell.Editor
{
    /// <summary>
    /// Makes the scene objects of a bundle:
    /// <code>
    /// specimen (Specimen, GazeSwitch; scaled)
    ///   r0_c0 (Tile, BoxCollider)
    ///     surfaces
    ///       CD31 (LODGroup): lod0, lod1, ...
    ///     volume: CD31 + Hoechst + MART1 (VolumeBox), four channels each
    /// </code>
    /// Names of objects and identifiers of sub-assets derive from the bundle's identifiers. They stay the same when the
    /// bundle is imported again, because overrides in scenes and prefab variants refer to them.
    /// </summary>
    sealed class SpecimenBuilder
    {
        public const string ShaderPath = "Packages/org.stereocell.bundle/Runtime/Shaders/StereoCellVolume.shader";
        const string ShaderName = "StereoCell/Volume";
        const int Entries = 256;  // texels of a transfer function
        const int MostShown = 4;  // channels that are visible after the import

        readonly Bundle bundle;
        readonly ImportOptions options;
        readonly SurfaceBuilder surfaces;
        readonly VolumeBuilder volumes;
        readonly Texture2D table;

        /// <param name="guid">GUID of the imported asset.</param>
        /// <param name="ownMaterial">Returns the project's material for a channel's surfaces; null keeps the bundle's
        /// materials.</param>
        /// <param name="addAsset">Adds a mesh, material or texture to the asset under an identifier.</param>
        public SpecimenBuilder(Bundle bundle, ImportOptions options, string guid, Func<string, Material> ownMaterial, Action<string, Object> addAsset)
        {
            this.bundle = bundle;
            this.options = options;
            var shader = Shader.Find(ShaderName);
            if (shader == null) throw new BundleException("the shader " + ShaderName + " is not in the project, expected " + ShaderPath + ": install the package again");
            table = MakeTable();
            addAsset("transfer functions", table);
            surfaces = new SurfaceBuilder(bundle, options, ownMaterial, addAsset);
            volumes = new VolumeBuilder(bundle, options, guid, shader, table, addAsset);
        }

        public void Build(GameObject root)
        {
            var specimen = root.AddComponent<Specimen>();
            specimen.table = table;
            specimen.budget = options.budget;
            AddChannels(specimen);
            var whole = bundle.Tiles.Select(tile => tile.Bounds).Aggregate(Union);
            foreach (var tile in bundle.Tiles) AddTile(root.transform, Placement.CentreOf(whole), tile, specimen);
            var size = Placement.SizeOf(whole);
            root.transform.localScale = Vector3.one * (options.longestEdge / Mathf.Max(size.x, Mathf.Max(size.y, size.z)));
            root.AddComponent<GazeSwitch>();
            specimen.Apply();
        }

        void AddChannels(Specimen specimen)
        {
            var row = 0;
            // The same channels as in the viewer are visible at first: those that the bundle opens with, at most four.
            var shown = bundle.Channels.Where(channel => channel.Opens).Take(MostShown).ToList();
            foreach (var entry in bundle.Channels)
            {
                var color = new Color((float)entry.Color[0], (float)entry.Color[1], (float)entry.Color[2], 1).gamma;
                specimen.channels.Add(new Channel
                {
                    id = entry.Id,
                    name = entry.Name,
                    color = color,
                    importedColor = color,
                    isVisible = shown.Contains(entry),
                    importedVisible = shown.Contains(entry),
                    functions = entry.Functions,
                    function = Math.Max(0, Array.IndexOf(entry.Functions, entry.Function)),
                    importedFunction = Math.Max(0, Array.IndexOf(entry.Functions, entry.Function)),
                    firstRow = row,
                });
                row += entry.Functions.Length;
            }
        }

        static Box Union(Box a, Box b)
        {
            return new Box
            {
                Min = a.Min.Zip(b.Min, Math.Min).ToArray(),
                Max = a.Max.Zip(b.Max, Math.Max).ToArray(),
            };
        }

        /// <summary>A texture with one row for each transfer function of each channel.</summary>
        Texture2D MakeTable()
        {
            var rows = new List<byte>();
            foreach (var channel in bundle.Channels)
            {
                var found = new Ktx2(bundle.Read(channel.Table), 0);
                if (found.Width != Entries || found.Height != channel.Functions.Length || found.Components != 4)
                {
                    throw new BundleException(channel.Table + ": size is " + found.Width + " x " + found.Height + " texels, expected " + Entries + " x " + channel.Functions.Length + " RGBA texels: build the bundle again");
                }
                rows.AddRange(found.Texels);
            }
            var texture = new Texture2D(Entries, Math.Max(1, rows.Count / (4 * Entries)), TextureFormat.RGBA32, false, true)
            {
                name = "transfer functions",
                wrapMode = TextureWrapMode.Clamp,
                filterMode = FilterMode.Bilinear,
            };
            if (rows.Count > 0) texture.SetPixelData(rows.ToArray(), 0);
            texture.Apply(false, false);
            return texture;
        }

        /// <param name="middle">Metres. The centre of the specimen, where its root is.</param>
        void AddTile(Transform root, Vector3 middle, TileEntry entry, Specimen specimen)
        {
            var pivot = Placement.CentreOf(entry.Bounds);
            var tile = Child(root, entry.Id, pivot - middle).AddComponent<Tile>();
            var collider = tile.gameObject.AddComponent<BoxCollider>();
            collider.isTrigger = true;  // only the ray of the gaze hits it; it does not stop other objects
            collider.size = Placement.SizeOf(entry.Bounds);
            tile.surfaces = Child(tile.transform, "surfaces", Vector3.zero);
            tile.volume = Child(tile.transform, "volume", Vector3.zero);
            for (var i = 0; i < bundle.Channels.Count; i++)
            {
                List<Level> levels;
                if (!bundle.Channels[i].Surfaces.TryGetValue(entry.Id, out levels)) continue;
                specimen.channels[i].surfaces.Add(surfaces.AddSurface(tile.surfaces.transform, bundle.Channels[i], entry, levels, pivot));
            }
            volumes.AddBoxes(tile.volume.transform, entry.Id, pivot);
            tile.surfaces.SetActive(entry.Representation != "volume");
            tile.volume.SetActive(entry.Representation != "mesh");
        }

        static GameObject Child(Transform parent, string name, Vector3 place)
        {
            var child = new GameObject(name);
            child.transform.SetParent(parent, false);
            child.transform.localPosition = place;
            return child;
        }
    }
}
