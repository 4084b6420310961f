// SPDX-License-Identifier: Apache-2.0
using System;
using System.Collections.Generic;
using System.IO;
using System.Security.Cryptography;
using System.Text;
using System.Text.RegularExpressions;
using Newtonsoft.Json;
using Newtonsoft.Json.Linq;

namespace StereoCell.Editor
{
    /// <summary>A box along the specimen's axes (x right, y up, z towards the viewer), um.</summary>
    public struct Box
    {
        public double[] Min;
        public double[] Max;
    }

    public sealed class TileEntry
    {
        public string Id;
        public string Representation;
        public Box Bounds;
    }

    /// <summary>One level of detail of a tile's surface: its file, and its largest distance from the finest
    /// level.</summary>
    public struct Level
    {
        public string Path;
        public double ErrorMetres;
    }

    public sealed class VolumeEntry
    {
        public string Tile;
        public string Path;
        public int[] Size;
        public int Apron;
        public Box Bounds;

        /// <summary>4 x 4 matrix, column by column, from the space of <see cref="Bounds"/> to the world, um.</summary>
        public double[] Matrix;

        public int[][] Levels;
    }

    public sealed class ChannelEntry
    {
        public string Id;
        public string Name;
        public double[] Color;
        public string Function;
        public string[] Functions;
        public string Table;

        /// <summary>Whether the channel is visible when the bundle is opened.</summary>
        public bool Opens;

        /// <summary>Levels of each tile, finest first.</summary>
        public Dictionary<string, List<Level>> Surfaces = new Dictionary<string, List<Level>>();

        public Dictionary<string, VolumeEntry> Volumes = new Dictionary<string, VolumeEntry>();
    }

    /// <summary>The contents of a bundle. Each file is compared with the size and the SHA-256 that files.json gives.</summary>
    public sealed class Bundle
    {
        const string Format = "stereocell-bundle";
        const int Version = 1;

        public readonly string Name;
        public readonly List<TileEntry> Tiles = new List<TileEntry>();
        public readonly List<ChannelEntry> Channels = new List<ChannelEntry>();

        /// <summary>The parts of the bundle that the viewer has and this package does not, in words.</summary>
        public readonly List<string> LeftOut = new List<string>();

        readonly BundleFiles folder;
        readonly JObject files;

        public Bundle(BundleFiles folder)
        {
            this.folder = folder;
            var manifest = Parse("manifest.json", ReadFile("manifest.json"));
            if ((string)Member(manifest, "format") != Format) throw new BundleException("manifest.json: format is " + manifest["format"] + ", expected " + Format + ": choose the folder of a StereoCell bundle");
            if ((int)Member(manifest, "version") != Version)
            {
                throw new BundleException("manifest.json: version is " + Member(manifest, "version") + ", expected " + Version + ": use the package of the StereoCell version that built the bundle");
            }
            var index = (JObject)Member(manifest, "files");
            files = Parse("files.json", Checked((string)Member(index, "path"), index));
            Name = (string)Member(Member(manifest, "specimen"), "name");
            foreach (var tile in Member(manifest, "tiles"))
            {
                Tiles.Add(new TileEntry
                {
                    Id = Identifier((string)Member(tile, "id")),
                    Representation = (string)Member(tile, "representation"),
                    Bounds = BoxOf(Member(tile, "bounds_um")),
                });
            }
            foreach (var channel in Member(manifest, "channels")) Channels.Add(ChannelOf(channel));
            if (manifest["additions"] != null) LeftOut.Add("added meshes (additions.glb)");
            if (manifest["lights"] != null) LeftOut.Add("lamps");
            if (manifest["views"] != null) LeftOut.Add("cameras");
        }

        /// <summary>The bytes of a file of the bundle.</summary>
        public byte[] Read(string path)
        {
            var entry = files[path] as JObject;
            if (entry == null) throw new BundleException(path + " is not listed in files.json. Build the bundle again.");
            return Checked(path, entry);
        }

        /// <summary>The SHA-256 that files.json states for a file, in hexadecimal digits.</summary>
        public string HashOf(string path)
        {
            var entry = files[path] as JObject;
            if (entry == null) throw new BundleException(path + " is not listed in files.json. Build the bundle again.");
            return (string)entry["sha256"];
        }

        byte[] Checked(string path, JObject entry)
        {
            var data = ReadFile(path);
            if (data.Length != (long)entry["bytes"]) throw new BundleException(path + ": size is " + data.Length + " bytes, expected " + entry["bytes"] + ": copy or build the bundle again");
            using (var sha256 = SHA256.Create())
            {
                var found = BitConverter.ToString(sha256.ComputeHash(data)).Replace("-", "").ToLowerInvariant();
                if (found != (string)entry["sha256"]) throw new BundleException(path + " is damaged: its SHA-256 differs from files.json. Copy or build the bundle again.");
            }
            return data;
        }

        byte[] ReadFile(string path)
        {
            var isOutside = Path.IsPathRooted(path) || path.Contains("\\") || Array.IndexOf(path.Split('/'), "..") >= 0;
            if (isOutside) throw new BundleException(path + " leads out of the bundle, expected a path inside its folder: build the bundle again");
            return folder.Read(path);
        }

        static JObject Parse(string path, byte[] data)
        {
            try
            {
                return JObject.Parse(Encoding.UTF8.GetString(data));
            }
            catch (JsonException error)
            {
                throw new BundleException(path + ": " + error.Message);
            }
        }

        /// <summary>Returns a member of a JSON object that every bundle must have.</summary>
        /// <exception cref="BundleException">The member is missing.</exception>
        static JToken Member(JToken from, string name)
        {
            var found = from is JObject ? from[name] : null;
            if (found == null) throw new BundleException("the bundle has no field " + (from.Path + "." + name).TrimStart('.') + ". Build the bundle again.");
            return found;
        }

        /// <summary>Check an identifier by the pattern of the bundle's schema: it becomes part of file names.</summary>
        static string Identifier(string id)
        {
            if (!Regex.IsMatch(id, "^[A-Za-z_][A-Za-z0-9_]*$")) throw new BundleException(id + " is not an identifier of a tile or channel, expected letters, digits and underscores: build the bundle again");
            return id;
        }

        ChannelEntry ChannelOf(JToken channel)
        {
            var entry = new ChannelEntry
            {
                Id = Identifier((string)Member(channel, "id")),
                Name = (string)Member(channel, "name"),
                Color = Member(channel, "color").ToObject<double[]>(),
                Function = (string)Member(channel, "transfer_function"),
                Functions = Member(channel, "transfer_functions").ToObject<string[]>(),
                Table = (string)Member(Member(channel, "lut"), "path"),
                Opens = channel["opens"] == null || (bool)channel["opens"],
            };
            if (Member(channel, "tileset") is JObject tileset) AddSurfaces(entry, (string)tileset["path"]);
            var path = (string)Member(Member(channel, "volumes"), "path");
            foreach (var volume in Member(Parse(path, Read(path)), "volumes"))
            {
                var found = new VolumeEntry
                {
                    Tile = (string)Member(volume, "tile"),
                    Path = (string)Member(Member(volume, "file"), "path"),
                    Size = Member(volume, "size").ToObject<int[]>(),
                    Apron = (int)Member(volume, "apron"),
                    Bounds = BoxOf(Member(volume, "bounds_um")),
                    Matrix = Member(volume, "matrix").ToObject<double[]>(),
                    Levels = Array.ConvertAll(((JArray)Member(volume, "levels")).ToObject<JObject[]>(), level => Member(level, "size").ToObject<int[]>()),
                };
                entry.Volumes.Add(found.Tile, found);
            }
            return entry;
        }

        /// <summary>Collect the levels of each tile. In the tileset's tree a coarse level is the parent of the
        /// next finer one.</summary>
        void AddSurfaces(ChannelEntry entry, string path)
        {
            var left = new Stack<KeyValuePair<JToken, string>>();
            left.Push(new KeyValuePair<JToken, string>(Member(Parse(path, Read(path)), "root"), path));
            while (left.Count > 0)
            {
                var here = left.Pop();
                var base_ = here.Value.Substring(0, here.Value.LastIndexOf('/') + 1);
                foreach (var child in here.Key["children"] ?? new JArray())
                {
                    left.Push(new KeyValuePair<JToken, string>(child, here.Value));
                }
                if (here.Key["content"] == null) continue;
                var address = base_ + (string)Member(here.Key["content"], "uri");
                if (address.EndsWith(".json", StringComparison.Ordinal))
                {
                    left.Push(new KeyValuePair<JToken, string>(Member(Parse(address, Read(address)), "root"), address));
                    continue;
                }
                var parts = address.Split('/');
                var tile = Identifier(parts[parts.Length - 2]);
                if (!entry.Surfaces.ContainsKey(tile)) entry.Surfaces.Add(tile, new List<Level>());
                entry.Surfaces[tile].Add(new Level { Path = address, ErrorMetres = (double)Member(here.Key, "geometricError") });
            }
            foreach (var levels in entry.Surfaces.Values) levels.Sort(FinerFirst);
        }

        /// <summary>Order levels by their errors; equal errors by their names, so lod1 comes before lod2.</summary>
        static int FinerFirst(Level a, Level b)
        {
            var byError = a.ErrorMetres.CompareTo(b.ErrorMetres);
            return byError != 0 ? byError : string.CompareOrdinal(a.Path, b.Path);
        }

        static Box BoxOf(JToken bounds)
        {
            return new Box { Min = Member(bounds, "min").ToObject<double[]>(), Max = Member(bounds, "max").ToObject<double[]>() };
        }
    }
}
