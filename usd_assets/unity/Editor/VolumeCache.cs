// SPDX-License-Identifier: Apache-2.0
using System;
using System.IO;
using System.Linq;
using UnityEditor;

namespace StereoCell.Editor
{
    /// <summary>
    /// Makes the files of voxels that the runtime reads, out of a bundle: for play in the editor when a box is first
    /// shown, for a player when it is built. They lie in Library/StereoCell, are named after their content, and can be
    /// deleted at any time.
    /// </summary>
    [InitializeOnLoad]
    public static class VolumeCache
    {
        public const string Folder = "Library/StereoCell";

        static VolumeCache()
        {
            VolumePlace.Maker = MakerOf;
        }

        /// <summary>The function that makes a box's file, on any thread, and returns its path.</summary>
        public static Func<string> MakerOf(VolumeBox box)
        {
            // Unity's own objects are asked here, on the main thread
            string asset = AssetDatabase.GUIDToAssetPath(box.specimenGuid), file = box.file;
            var sources = box.sources;
            var level = box.level;
            var path = Path.GetFullPath(Path.Combine(Folder, file));
            return () =>
            {
                if (!File.Exists(path)) Write(asset, sources, level, path);
                return path;
            };
        }

        static void Write(string asset, string[] sources, int level, string path)
        {
            if (string.IsNullOrEmpty(asset)) throw new BundleException(Path.GetFileName(path) + ": the bundle's asset is no longer in the project");
            Directory.CreateDirectory(Path.GetDirectoryName(path));
            var part = path + "." + Guid.NewGuid().ToString("N") + ".part";
            try
            {
                using (var files = BundleFiles.Open(asset))
                {
                    var bundle = new Bundle(files);
                    var volumes = sources.Select(source => new Ktx2(bundle.Read(source), level)).ToArray();
                    var first = volumes[0];
                    if (volumes.Any(each => each.Width != first.Width || each.Height != first.Height || each.Depth != first.Depth || each.Components != 1))
                    {
                        throw new BundleException(string.Join(", ", sources) + ": expected one channel each, of one size");
                    }
                    using (var stream = File.Create(part))
                    {
                        VolumeFile.Write(stream, first.Width, first.Height, first.Depth, volumes.Select(each => each.Texels).ToArray());
                    }
                }
                if (!File.Exists(path)) File.Move(part, path);
            }
            finally
            {
                File.Delete(part);
            }
        }
    }
}
