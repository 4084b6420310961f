// SPDX-License-Identifier: Apache-2.0
using System;
using System.IO;
using System.IO.Compression;
using System.Linq;
using System.Text;
using Newtonsoft.Json;
using Newtonsoft.Json.Linq;

namespace StereoCell.Editor
{
    /// <summary>A bundle cannot be read; the message is one line for the user.</summary>
    public sealed class BundleException : IOException
    {
        public BundleException(string message) : base(message) { }
    }

    /// <summary>
    /// The files of a bundle behind a `.stereocell` asset. The asset is a zip file of the bundle's folder, or a link to
    /// this folder. A link is the JSON object {"bundle": "folder"}. Its path is absolute, or relative to the folder of
    /// the asset.
    /// </summary>
    public sealed class BundleFiles : IDisposable
    {
        const string First = "manifest.json";
        const int MostOfLink = 64 << 10;  // bytes, largest size of a link's file

        readonly ZipArchive zip;
        readonly string prefix = "";

        BundleFiles(string folder)
        {
            Folder = folder;
        }

        BundleFiles(ZipArchive zip, string prefix)
        {
            this.zip = zip;
            this.prefix = prefix;
        }

        /// <summary>The bundle's folder; null if it is a zip file.</summary>
        public string Folder { get; private set; }

        public static BundleFiles Open(string asset)
        {
            var folder = LinkedFolder(asset);
            if (folder != null) return new BundleFiles(folder);
            ZipArchive zip;
            try
            {
                zip = ZipFile.OpenRead(asset);
            }
            catch (InvalidDataException error)
            {
                throw new BundleException(asset + " is a damaged zip file (" + error.Message + "). Copy the bundle again.");
            }
            var found = zip.Entries.Where(entry => entry.Name == First).OrderBy(entry => entry.FullName.Length).FirstOrDefault();
            if (found != null) return new BundleFiles(zip, found.FullName.Substring(0, found.FullName.Length - First.Length));
            zip.Dispose();
            throw new BundleException(asset + ": the zip file has no manifest.json, expected a zip file of a bundle: copy the bundle again");
        }

        public static BundleFiles OpenFolder(string folder)
        {
            return new BundleFiles(folder);
        }

        /// <summary>The folder that a link names; null if the asset is a zip file.</summary>
        public static string LinkedFolder(string asset)
        {
            using (var stream = File.OpenRead(asset))
            {
                if (stream.ReadByte() == 'P' && stream.ReadByte() == 'K') return null;
                if (stream.Length > MostOfLink) throw new BundleException(asset + ": found another file, expected a zip file of a bundle, or a link to its folder.");
            }
            try
            {
                var named = (string)JObject.Parse(File.ReadAllText(asset, Encoding.UTF8))["bundle"];
                if (string.IsNullOrEmpty(named)) throw new BundleException(asset + ": the link names no folder, expected {\"bundle\": \"the bundle's folder\"}.");
                return Path.GetFullPath(Path.Combine(Path.GetDirectoryName(Path.GetFullPath(asset)), named));
            }
            catch (JsonException)
            {
                throw new BundleException(asset + ": found another file, expected a zip file of a bundle, or {\"bundle\": \"the bundle's folder\"}.");
            }
        }

        /// <summary>The text of a link. The path to a folder inside the project is relative, so that it stays right when
        /// the project is moved.</summary>
        public static string LinkTo(string folder, string asset)
        {
            var whole = Path.GetFullPath(folder).Replace('\\', '/');
            var project = Path.GetFullPath(".").Replace('\\', '/') + "/";
            var named = whole.StartsWith(project, StringComparison.Ordinal) ? RelativePath(asset, whole) : whole;
            return new JObject(new JProperty("bundle", named)).ToString() + "\n";
        }

        /// <summary>The path to a file or folder, relative to the folder of another file, with slashes.</summary>
        public static string RelativePath(string file, string path)
        {
            var from = Path.GetFullPath(file).Replace('\\', '/').Split('/');
            var to = Path.GetFullPath(path).Replace('\\', '/').Split('/');
            var same = 0;
            while (same < from.Length - 1 && same < to.Length - 1 && from[same] == to[same]) same++;
            if (same == 0) return string.Join("/", to);  // on another drive
            var up = Enumerable.Repeat("..", from.Length - 1 - same).Concat(to.Skip(same)).ToArray();
            return (up[0] == ".." ? "" : "./") + string.Join("/", up);
        }

        public byte[] Read(string path)
        {
            if (zip != null) return ReadEntry(path);
            try
            {
                return File.ReadAllBytes(Path.Combine(Folder, path));
            }
            catch (Exception error) when (error is FileNotFoundException || error is DirectoryNotFoundException)
            {
                throw new BundleException(path + " is missing in " + Folder + ". Build the bundle again, or link another folder.");
            }
        }

        public void Dispose()
        {
            if (zip != null) zip.Dispose();
        }

        byte[] ReadEntry(string path)
        {
            var entry = zip.GetEntry(prefix + path);
            if (entry == null) throw new BundleException(path + " is missing in the zip file. Copy the bundle again.");
            using (var stream = entry.Open())
            using (var memory = new MemoryStream())
            {
                stream.CopyTo(memory);
                return memory.ToArray();
            }
        }
    }
}
