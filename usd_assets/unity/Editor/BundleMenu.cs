// SPDX-License-Identifier: Apache-2.0
using System;
using System.IO;
using System.IO.Compression;
using UnityEditor;
using UnityEngine;

namespace StereoCell.Editor
{
    /// <summary>Adds a bundle to the project, as a link to its folder or as a copy in one file.</summary>
    public static class BundleMenu
    {
        [MenuItem("Assets/StereoCell/Link Bundle...", false, 30)]
        static void ChooseLink()
        {
            Choose(Link);
        }

        [MenuItem("Assets/StereoCell/Copy Bundle...", false, 31)]
        static void ChooseCopy()
        {
            Choose(Copy);
        }

        static void Choose(Func<string, string, GameObject> bring)
        {
            var folder = EditorUtility.OpenFolderPanel("Choose the bundle's folder, which holds manifest.json", "", "");
            if (string.IsNullOrEmpty(folder)) return;
            try
            {
                var root = new DirectoryInfo(folder);
                var name = root.Name == "bundle" && root.Parent != null ? root.Parent.Name : root.Name;
                Selection.activeObject = bring(folder, "Assets/" + name + "." + SpecimenImporter.Ending);
            }
            catch (IOException error)
            {
                EditorUtility.DisplayDialog("StereoCell", error.Message, "OK");
            }
        }

        /// <summary>Import a bundle from its own folder. The specimen is imported again after each new build.</summary>
        /// <param name="asset">The file to write, such as "Assets/half.stereocell". If another file has this name, it
        /// stays, and the new file's name gets a number.</param>
        public static GameObject Link(string folder, string asset)
        {
            CheckBundle(folder);
            var text = BundleFiles.LinkTo(folder, asset);
            if (!File.Exists(asset) || File.ReadAllText(asset) != text)
            {
                asset = FreePath(asset);  // in the same folder, so a relative path in the text stays right
                File.WriteAllText(asset, text);
            }
            BundleWatcher.Register(folder);
            return Imported(asset);
        }

        /// <summary>Import a copy of a bundle: one zip file that belongs to the project.</summary>
        /// <param name="asset">The file to write. If the name is taken, the new file's name gets a number.</param>
        public static GameObject Copy(string folder, string asset)
        {
            CheckBundle(folder);
            asset = FreePath(asset);
            // No compression: each file of a bundle is already compressed in its own format.
            ZipFile.CreateFromDirectory(folder, asset, CompressionLevel.NoCompression, false);
            return Imported(asset);
        }

        static void CheckBundle(string folder)
        {
            using (var files = BundleFiles.OpenFolder(folder)) new Bundle(files);
        }

        static string FreePath(string asset)
        {
            Directory.CreateDirectory(Path.GetDirectoryName(asset));
            return File.Exists(asset) ? AssetDatabase.GenerateUniqueAssetPath(asset) : asset;
        }

        static GameObject Imported(string asset)
        {
            AssetDatabase.ImportAsset(asset);
            var made = AssetDatabase.LoadAssetAtPath<GameObject>(asset);
            if (made == null) throw new BundleException(asset + " was not imported. The console shows the reason.");
            return made;
        }
    }
}
