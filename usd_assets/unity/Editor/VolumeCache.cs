// SPDX-License-Identifier: Apache-2.0
using System;
using System.IO;
using System.Linq;
using UnityEditor;

namespace StereoCell.Editor
{
    /// <summary>
    /// Converts volumes of a bundle to the voxel files that the runtime reads. In the editor, a file is made when its box
    /// is first shown. For a player, all files are made during the build. They lie in Library/StereoCell, are named after
    /// their content, and can be deleted at any time.
    /// </summary>
    [InitializeOnLoad]
    public static class VolumeCache
    {
        public const string Folder = "Library/StereoCell";

        static VolumeCache()
        {
            VolumePlace.Maker = MakerOf;
        }

        /// <summary>A function that makes a box's file and returns its path. The function may run on any thread.</summary>
        public static Func<string> MakerOf(VolumeBox box)
        {
            // Unity's objects may be read only on the main thread, so their values are copied here.
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
            if (string.IsNullOrEmpty(asset)) throw new BundleException(Path.GetFileName(path) + ": the bundle's asset is not in the project any more. Link or copy the bundle again.");
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
                        throw new BundleException(string.Join(", ", sources) + ": sizes or channels differ, expected volumes of one size with one channel each: build the bundle again");
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
