// SPDX-License-Identifier: Apache-2.0
using System.Collections.Generic;
using System.IO;
using UnityEditor;
using UnityEngine;
using UnityEngine.Rendering;

namespace StereoCell.Editor
{
    /// <summary>
    /// Has specimens imported again whose bundle was built anew: a linked folder lies outside the project, so Unity does
    /// not see its changes. manifest.json holds the hash of the list of all files, so a change of any file changes it.
    /// Bundles are looked at when the editor starts, and whenever it comes to the front.
    /// </summary>
    [InitializeOnLoad]
    public static class BundleWatcher
    {
        public const string PipelineName = "StereoCell/pipeline";

        /// <summary>What was registered since the scripts were loaded.</summary>
        static readonly Dictionary<string, Hash128> registered = new Dictionary<string, Hash128>();

        static BundleWatcher()
        {
            EditorApplication.delayCall += Look;
            EditorApplication.focusChanged += hasFocus =>
            {
                if (hasFocus) Look();
            };
        }

        /// <summary>The dependency of a specimen on its linked folder.</summary>
        public static string NameOf(string folder)
        {
            return "StereoCell/bundle/" + Path.GetFullPath(folder).Replace('\\', '/');
        }

        /// <summary>Note what linked bundles hold now, and have Unity import the specimens for which that has changed.</summary>
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
                    // The import of this asset says what is wrong with it.
                }
            }
            if (isNew) AssetDatabase.Refresh();
        }

        /// <summary>Note what a linked folder holds. Returns whether it is something new.</summary>
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
