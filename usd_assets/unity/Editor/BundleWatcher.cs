// SPDX-License-Identifier: Apache-2.0
using System.Collections.Generic;
using System.IO;
using UnityEditor;
using UnityEngine;
using UnityEngine.Rendering;

namespace StereoCell.Editor
{
    /// <summary>
    /// Imports specimens again after their bundle was rebuilt. A linked folder lies outside the project, so Unity does
    /// not see its changes. The class therefore checks each linked manifest.json when the editor starts and whenever
    /// the editor comes to the front. The manifest holds the hash of the list of all files, so a change of any file
    /// changes it.
    /// </summary>
    [InitializeOnLoad]
    public static class BundleWatcher
    {
        public const string PipelineName = "StereoCell/pipeline";

        /// <summary>Hashes that were registered since the scripts were loaded, by the dependency's name.</summary>
        static readonly Dictionary<string, Hash128> registered = new Dictionary<string, Hash128>();

        static BundleWatcher()
        {
            EditorApplication.delayCall += Look;
            EditorApplication.focusChanged += hasFocus =>
            {
                if (hasFocus) Look();
            };
        }

        /// <summary>The name of a specimen's dependency on its linked folder.</summary>
        public static string NameOf(string folder)
        {
            return "StereoCell/bundle/" + Path.GetFullPath(folder).Replace('\\', '/');
        }

        /// <summary>Register the current content of all linked bundles. Unity then imports the specimens whose bundle has
        /// changed.</summary>
        public static void Look()
        {
            var pipeline = GraphicsSettings.currentRenderPipeline;
            var isNew = Register(PipelineName, pipeline == null ? "built-in" : pipeline.GetType().Name);
            foreach (var asset in Directory.GetFiles("Assets", "*." + SpecimenImporter.Ending, SearchOption.AllDirectories))
            {
                try
                {
                    var folder = BundleFiles.LinkedFolder(asset);
                    if (folder != null) isNew |= Register(folder);
                }
                catch (IOException)
                {
                    // The import of this asset reports the error.
                }
            }
            if (isNew) AssetDatabase.Refresh();
        }

        /// <summary>Register the content of a linked folder. Returns whether it has changed.</summary>
        public static bool Register(string folder)
        {
            var manifest = Path.Combine(folder, "manifest.json");
            return Register(NameOf(folder), File.Exists(manifest) ? File.ReadAllText(manifest) : "");
        }

        static bool Register(string name, string content)
        {
            Hash128 before, now = Hash128.Compute(content);
            if (registered.TryGetValue(name, out before) && before.Equals(now)) return false;
            registered[name] = now;
            AssetDatabase.RegisterCustomDependency(name, now);
            return true;
        }
    }
}
