// SPDX-License-Identifier: Apache-2.0
using System;
using System.Collections.Generic;
using System.Linq;
using System.Security.Cryptography;
using System.Text;
using UnityEngine;
using UnityEngine.Rendering;
using Object = UnityEngine.Object;

namespace StereoCell.Editor
{
    /// <summary>Makes the boxes in which volumes are drawn. Their voxels are not part of the asset; they stay in files of
    /// <see cref="VolumeCache"/>.</summary>
    sealed class VolumeBuilder
    {
        const int ChannelsOfBox = 4;

        readonly Bundle bundle;
        readonly ImportOptions options;
        readonly string guid;
        readonly Shader shader;
        readonly Texture2D table;
        readonly Action<string, Object> addAsset;
        readonly Dictionary<VolumeEntry, Placement> places = new Dictionary<VolumeEntry, Placement>();

        /// <param name="guid">GUID of the imported asset.</param>
        public VolumeBuilder(Bundle bundle, ImportOptions options, string guid, Shader shader, Texture2D table, Action<string, Object> addAsset)
        {
            this.bundle = bundle;
            this.options = options;
            this.guid = guid;
            this.shader = shader;
            this.table = table;
            this.addAsset = addAsset;
            foreach (var volume in bundle.Channels.SelectMany(channel => channel.Volumes.Values)) places.Add(volume, new Placement(volume));
        }

        /// <param name="pivot">Metres. Position of the tile's object in the specimen.</param>
        public void AddBoxes(Transform parent, string tile, Vector3 pivot)
        {
            var boxes = Boxes(tile);
            if (boxes.Count == 0) return;
            var levels = boxes.Select(box => new KeyValuePair<int[][], int>(bundle.Channels[box[0]].Volumes[tile].Levels, box.Count));
            var level = options.LevelFor(levels.ToList());
            for (var i = 0; i < boxes.Count; i++) AddBox(parent, tile, boxes[i], tile + (i > 0 ? "_" + i : ""), level, pivot);
        }

        /// <summary>Group the channels of a tile. Up to four channels with the same grid share a texture and are drawn in
        /// one pass.</summary>
        List<List<int>> Boxes(string tile)
        {
            var boxes = new List<List<int>>();
            for (var i = 0; i < bundle.Channels.Count; i++)
            {
                VolumeEntry volume;
                if (!bundle.Channels[i].Volumes.TryGetValue(tile, out volume)) continue;
                var box = boxes.Find(each => each.Count < ChannelsOfBox && LieAlike(bundle.Channels[each[0]].Volumes[tile], volume));
                if (box == null) boxes.Add(box = new List<int>());
                box.Add(i);
            }
            return boxes;
        }

        static bool LieAlike(VolumeEntry a, VolumeEntry b)
        {
            return a.Size.SequenceEqual(b.Size) && a.Apron == b.Apron && a.Matrix.SequenceEqual(b.Matrix)
                && a.Bounds.Min.SequenceEqual(b.Bounds.Min) && a.Bounds.Max.SequenceEqual(b.Bounds.Max);
        }

        void AddBox(Transform parent, string tile, List<int> channels, string name, int level, Vector3 pivot)
        {
            var volumes = channels.Select(i => bundle.Channels[i].Volumes[tile]).ToArray();
            var place = places[volumes[0]];
            var mesh = BoxMesh(place);
            addAsset("volume box " + name, mesh);
            var material = MakeMaterial(place, level);
            material.name = "volume " + name;
            addAsset("volume material " + name, material);

            var made = new GameObject(string.Join(" + ", channels.Select(i => bundle.Channels[i].Id).ToArray()));
            made.transform.SetParent(parent, false);
            made.transform.localPosition = place.Centre - pivot;
            made.AddComponent<MeshFilter>().sharedMesh = mesh;
            var renderer = made.AddComponent<MeshRenderer>();
            renderer.sharedMaterial = material;
            renderer.shadowCastingMode = ShadowCastingMode.Off;
            renderer.receiveShadows = false;
            var box = made.AddComponent<VolumeBox>();
            box.channels = channels.ToArray();
            box.size = volumes[0].Levels[level];
            box.specimenGuid = guid;
            box.sources = volumes.Select(volume => volume.Path).ToArray();
            box.level = level;
            box.file = name + "-" + ContentOf(box.sources, level) + ".volume";
        }

        /// <summary>Hexadecimal digits from a hash of the voxels' files. A file with older voxels has another name, so it is
        /// never used by mistake.</summary>
        string ContentOf(string[] sources, int level)
        {
            var text = string.Join(" ", sources.Select(path => bundle.HashOf(path)).ToArray()) + " " + level;
            using (var sha256 = SHA256.Create())
            {
                return BitConverter.ToString(sha256.ComputeHash(Encoding.ASCII.GetBytes(text)), 0, 8).Replace("-", "").ToLowerInvariant();
            }
        }

        Material MakeMaterial(Placement place, int level)
        {
            Vector4 allLow, allHigh;
            place.Around(places.Values, out allLow, out allHigh);
            var material = new Material(shader);
            material.SetTexture("_Table", table);
            material.SetVector("_Size", place.Size);
            material.SetVector("_TexLow", place.TexLow);
            material.SetVector("_TexHigh", place.TexHigh);
            material.SetVector("_AllLow", allLow);
            material.SetVector("_AllHigh", allHigh);
            for (var row = 0; row < 3; row++) material.SetVector("_ToBox" + row, place.ToBox[row]);
            material.SetFloat("_Voxel", place.Voxel);
            material.SetFloat("_MinStep", place.Voxel * (1 << level));
            // Each tile on a ray takes at least one step, however short the ray's path through it. Therefore one step is
            // reserved for each other tile.
            material.SetFloat("_Spare", Math.Min(bundle.Tiles.Count - 1, 50));
            return material;
        }

        static Mesh BoxMesh(Placement place)
        {
            var mesh = new Mesh { name = "box", vertices = place.Corners };
            // Seen from outside, corners run clockwise, which is a front face in Unity. A matrix that mirrors the box
            // reverses this order.
            int[] triangles =
            {
                0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5, 0, 1, 5, 0, 5, 4,
                2, 6, 7, 2, 7, 3, 0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6,
            };
            Vector3 x = place.Corners[1] - place.Corners[0], y = place.Corners[2] - place.Corners[0], z = place.Corners[4] - place.Corners[0];
            if (Vector3.Dot(Vector3.Cross(x, y), z) < 0) Array.Reverse(triangles);
            mesh.triangles = triangles;
            mesh.RecalculateBounds();
            return mesh;
        }
    }
}
