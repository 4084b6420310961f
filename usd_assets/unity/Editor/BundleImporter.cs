// SPDX-License-Identifier: Apache-2.0
using System;
using System.Collections.Generic;
using System.IO;
using System.Linq;
using UnityEditor;
using UnityEngine;
using UnityEngine.Rendering;
using Object = UnityEngine.Object;

namespace StereoCell.Editor
{
    [Serializable]
    public sealed class ImportOptions
    {
        /// <summary>Longest edge of the specimen in the scene, units: its root is scaled to it.</summary>
        public float longestEdge = 0.5f;

        /// <summary>Most texels along an edge of a tile's volume: a coarser level is taken where it has more.</summary>
        public int mostTexels = 256;

        /// <summary>Error that a level of detail may show, in pixels of a screen or eye so many pixels high.</summary>
        public float errorPixels = 2;
        public int screenPixels = 1080;
    }

    /// <summary>
    /// Makes a prefab of a bundle that lies anywhere on disk. Surfaces are copied and imported by glTFast;
    /// volumes become Texture3D assets:
    /// <code>
    /// specimen (Specimen, GazeSwitch; scaled)
    ///   r0_c0 (Tile, BoxCollider)
    ///     surfaces
    ///       CD31 (LODGroup): lod0, lod1, ...
    ///     volume: CD31 + Hoechst + MART1 (VolumeBox), four channels each
    /// </code>
    /// From a script: <c>BundleImporter.Import(folder, "Assets/Specimen")</c>.
    /// </summary>
    public static class BundleImporter
    {
        const string ShaderName = "StereoCell/Volume";
        const int Entries = 256;
        const int MostOfUnity = 2048;  // texels along an edge of a 3D texture
        const int ChannelsOfBox = 4;

        [MenuItem("Assets/Import StereoCell Bundle...", false, 30)]
        static void Choose()
        {
            var folder = EditorUtility.OpenFolderPanel("The bundle's folder, which holds manifest.json", "", "");
            if (string.IsNullOrEmpty(folder)) return;
            try
            {
                var root = new DirectoryInfo(folder);
                var name = root.Name == "bundle" && root.Parent != null ? root.Parent.Name : root.Name;
                Selection.activeObject = Import(folder, "Assets/StereoCell/" + name);
            }
            catch (OperationCanceledException)
            {
            }
            catch (Exception error) when (error is BundleException || error is InvalidDataException || error is IOException)
            {
                EditorUtility.DisplayDialog("StereoCell", error.Message, "OK");
            }
        }

        /// <summary>Returns the prefab, which is the last file that is written.</summary>
        /// <param name="folder">The bundle's.</param>
        /// <param name="target">Of the project, as "Assets/Specimen"; it is made where it is missing.</param>
        public static GameObject Import(string folder, string target, ImportOptions options = null)
        {
            var shader = Shader.Find(ShaderName);
            if (shader == null) throw new BundleException("the shader " + ShaderName + " is not in the project");
            GameObject root = null;
            try
            {
                Report("manifest.json", 0);
                var bundle = new Bundle(folder);
                var work = new Work(bundle, target, options ?? new ImportOptions(), shader);
                root = new GameObject(bundle.Name);
                work.Build(root);
                return PrefabUtility.SaveAsPrefabAsset(root, target + "/" + FileName(bundle.Name) + ".prefab");
            }
            finally
            {
                EditorUtility.ClearProgressBar();
                if (root != null) Object.DestroyImmediate(root);
            }
        }

        static string FileName(string name)
        {
            return string.Join("_", name.Split(Path.GetInvalidFileNameChars()));
        }

        static void Report(string what, float share)
        {
            if (EditorUtility.DisplayCancelableProgressBar("StereoCell", what, share)) throw new OperationCanceledException();
        }

        sealed class Work
        {
            readonly Bundle bundle;
            readonly string target;
            readonly ImportOptions options;
            readonly Shader shader;
            readonly Dictionary<VolumeEntry, Placement> places = new Dictionary<VolumeEntry, Placement>();

            public Work(Bundle bundle, string target, ImportOptions options, Shader shader)
            {
                this.bundle = bundle;
                this.target = target;
                this.options = options;
                this.shader = shader;
                foreach (var volume in bundle.Channels.SelectMany(channel => channel.Volumes.Values)) places.Add(volume, new Placement(volume));
            }

            public void Build(GameObject root)
            {
                CopySurfaces();
                Directory.CreateDirectory(target + "/volumes");
                AssetDatabase.Refresh();  // glTFast imports what was copied
                var specimen = root.AddComponent<Specimen>();
                specimen.table = MakeTable();
                var row = 0;
                // as the viewer opens: label maps, if there are any, and no more than four
                var maps = bundle.Channels.Where(channel => channel.IsLabelMap).ToList();
                var shown = (maps.Count > 0 ? maps : bundle.Channels).Take(ChannelsOfBox).ToList();
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
                        functions = entry.Functions,
                        function = Math.Max(0, Array.IndexOf(entry.Functions, entry.Function)),
                        firstRow = row,
                    });
                    row += entry.Functions.Length;
                }
                var whole = bundle.Tiles.Select(tile => tile.Bounds).Aggregate(Union);
                var done = 0;
                foreach (var tile in bundle.Tiles)
                {
                    Report(tile.Id, 0.5f + 0.5f * done++ / bundle.Tiles.Count);
                    AddTile(root.transform, Placement.CentreOf(whole), tile, specimen);
                }
                var size = Placement.SizeOf(whole);
                root.transform.localScale = Vector3.one * (options.longestEdge / Mathf.Max(size.x, Mathf.Max(size.y, size.z)));
                root.AddComponent<GazeSwitch>();
                specimen.Apply();
                AssetDatabase.SaveAssets();
            }

            static Box Union(Box a, Box b)
            {
                return new Box
                {
                    Min = a.Min.Zip(b.Min, Math.Min).ToArray(),
                    Max = a.Max.Zip(b.Max, Math.Max).ToArray(),
                };
            }

            string SurfacePath(ChannelEntry channel, string tile, int level)
            {
                return target + "/surfaces/" + channel.Id + "_" + tile + "_lod" + level + ".glb";
            }

            void CopySurfaces()
            {
                Directory.CreateDirectory(target + "/surfaces");
                var done = 0;
                foreach (var channel in bundle.Channels)
                {
                    Report("surfaces of " + channel.Name, 0.5f * done++ / bundle.Channels.Count);
                    foreach (var surface in channel.Surfaces)
                    {
                        for (var i = 0; i < surface.Value.Count; i++)
                        {
                            File.WriteAllBytes(SurfacePath(channel, surface.Key, i), bundle.Read(surface.Value[i].Path));
                        }
                    }
                }
            }

            /// <summary>The transfer functions of all channels, a row each.</summary>
            Texture2D MakeTable()
            {
                var rows = new List<byte>();
                foreach (var channel in bundle.Channels)
                {
                    var found = new Ktx2(bundle.Read(channel.Table), 0);
                    if (found.Width != Entries || found.Height != channel.Functions.Length || found.Components != 4)
                    {
                        throw new BundleException(channel.Table + ": expected " + Entries + " x " + channel.Functions.Length + " RGBA texels");
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
                AssetDatabase.CreateAsset(texture, target + "/transfer functions.asset");
                return texture;
            }

            /// <param name="middle">Of the specimen, where its root is.</param>
            void AddTile(Transform root, Vector3 middle, TileEntry entry, Specimen specimen)
            {
                var pivot = Placement.CentreOf(entry.Bounds);
                var tile = Child(root, entry.Id, pivot - middle).AddComponent<Tile>();
                var collider = tile.gameObject.AddComponent<BoxCollider>();
                collider.isTrigger = true;  // it is for the gaze, nothing shall bump into it
                collider.size = Placement.SizeOf(entry.Bounds);
                tile.surfaces = Child(tile.transform, "surfaces", Vector3.zero);
                tile.volume = Child(tile.transform, "volume", Vector3.zero);
                for (var i = 0; i < bundle.Channels.Count; i++)
                {
                    List<Level> levels;
                    if (!bundle.Channels[i].Surfaces.TryGetValue(entry.Id, out levels)) continue;
                    specimen.channels[i].surfaces.Add(AddSurface(tile.surfaces.transform, bundle.Channels[i], entry, levels, pivot));
                }
                var boxes = Boxes(entry.Id);
                for (var i = 0; i < boxes.Count; i++)
                {
                    var path = target + "/volumes/" + entry.Id + (i > 0 ? "_" + i : "") + ".asset";
                    AddVolume(tile.volume.transform, entry.Id, boxes[i], path, pivot);
                }
                tile.Show(entry.Representation != "volume", entry.Representation != "mesh");
            }

            GameObject AddSurface(Transform parent, ChannelEntry channel, TileEntry tile, List<Level> levels, Vector3 pivot)
            {
                var holder = Child(parent, channel.Id, Vector3.zero);
                var size = Placement.SizeOf(tile.Bounds);
                var edge = Mathf.Max(size.x, Mathf.Max(size.y, size.z));
                var heights = Placement.LodHeights(levels, edge, options.errorPixels, options.screenPixels);
                var lods = new LOD[levels.Count];
                for (var i = 0; i < levels.Count; i++)
                {
                    var path = SurfacePath(channel, tile.Id, i);
                    var asset = AssetDatabase.LoadAssetAtPath<GameObject>(path);
                    if (asset == null) throw new BundleException(path + " was not imported: are glTFast and meshoptimizer decompression in the project?");
                    var surface = (GameObject)PrefabUtility.InstantiatePrefab(asset, holder.transform);
                    surface.name = "lod" + i;
                    surface.transform.localPosition -= pivot;  // a file's places are the specimen's
                    lods[i] = new LOD(heights[i], surface.GetComponentsInChildren<Renderer>());
                }
                var group = holder.AddComponent<LODGroup>();
                group.SetLODs(lods);
                group.localReferencePoint = Vector3.zero;
                group.size = edge;
                return holder;
            }

            /// <summary>Up to four channels that lie alike share a texture and a march.</summary>
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

            void AddVolume(Transform parent, string tile, List<int> channels, string path, Vector3 pivot)
            {
                var volumes = channels.Select(i => bundle.Channels[i].Volumes[tile]).ToArray();
                var place = places[volumes[0]];
                var level = Placement.LevelWithin(volumes[0].Levels, Math.Min(options.mostTexels, MostOfUnity));
                var texture = MakeTexture(volumes, level);
                AssetDatabase.CreateAsset(texture, path);
                var mesh = BoxMesh(place);
                AssetDatabase.AddObjectToAsset(mesh, texture);
                var material = MakeMaterial(place, texture, level);
                AssetDatabase.AddObjectToAsset(material, texture);

                var name = string.Join(" + ", channels.Select(i => bundle.Channels[i].Id).ToArray());
                var box = Child(parent, name, place.Centre - pivot);
                box.AddComponent<MeshFilter>().sharedMesh = mesh;
                var renderer = box.AddComponent<MeshRenderer>();
                renderer.sharedMaterial = material;
                renderer.shadowCastingMode = ShadowCastingMode.Off;
                renderer.receiveShadows = false;
                box.AddComponent<VolumeBox>().channels = channels.ToArray();
            }

            Texture3D MakeTexture(VolumeEntry[] volumes, int level)
            {
                var size = volumes[0].Levels[level];
                var format = volumes.Length == 1 ? TextureFormat.R8 : volumes.Length == 2 ? TextureFormat.RG16 : TextureFormat.RGBA32;
                var stride = volumes.Length > 2 ? 4 : volumes.Length;
                var texels = new byte[checked(size[0] * size[1] * size[2] * stride)];
                for (var c = 0; c < volumes.Length; c++)
                {
                    var found = new Ktx2(bundle.Read(volumes[c].Path), level);
                    if (found.Texels.Length * stride != texels.Length || found.Width != size[0] || found.Height != size[1])
                    {
                        throw new BundleException(volumes[c].Path + " is of another size than volumes.json says");
                    }
                    for (var i = 0; i < found.Texels.Length; i++) texels[stride * i + c] = found.Texels[i];
                }
                var texture = new Texture3D(size[0], size[1], size[2], format, false)
                {
                    name = "volume of " + volumes[0].Tile,
                    wrapMode = TextureWrapMode.Clamp,
                    filterMode = FilterMode.Bilinear,
                };
                texture.SetPixelData(texels, 0);
                texture.Apply(false, false);
                return texture;
            }

            Material MakeMaterial(Placement place, Texture3D texture, int level)
            {
                Vector4 allLow, allHigh;
                place.Around(places.Values, out allLow, out allHigh);
                var material = new Material(shader) { name = texture.name };
                material.SetTexture("_Volume", texture);
                material.SetTexture("_Table", AssetDatabase.LoadAssetAtPath<Texture2D>(target + "/transfer functions.asset"));
                material.SetVector("_Size", place.Size);
                material.SetVector("_TexLow", place.TexLow);
                material.SetVector("_TexHigh", place.TexHigh);
                material.SetVector("_AllLow", allLow);
                material.SetVector("_AllHigh", allHigh);
                for (var row = 0; row < 3; row++) material.SetVector("_ToBox" + row, place.ToBox[row]);
                material.SetFloat("_Voxel", place.Voxel);
                material.SetFloat("_MinStep", place.Voxel * (1 << level));
                // each tile takes a step at least, however short the ray's way through it
                material.SetFloat("_Spare", Math.Min(bundle.Tiles.Count - 1, 50));
                return material;
            }

            static Mesh BoxMesh(Placement place)
            {
                var mesh = new Mesh { name = "box", vertices = place.Corners };
                // clockwise from outside, Unity's front; the corners keep their order under a rotation, a matrix
                // that mirrors turns them over
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

            static GameObject Child(Transform parent, string name, Vector3 place)
            {
                var child = new GameObject(name);
                child.transform.SetParent(parent, false);
                child.transform.localPosition = place;
                return child;
            }
        }
    }
}
